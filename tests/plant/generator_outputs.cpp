// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/generator_outputs.h"

#include <array>
#include <string>
#include <string_view>

namespace linegate::plant {
namespace {

// An object that an RPDO of a profile maps.
struct OutputRow {
  std::string_view profile;
  const char* record;  // communication record of the RPDO
  unsigned sub;        // sub-index of the mapping
  const char* object;
  unsigned bytes;
};
constexpr std::array<OutputRow, 8> kOutputs{{
    {"digital-io", "1400", 1, "6200:1", 1},
    {"digital-io", "1400", 2, "6200:2", 1},
    {"analog-io", "1401", 1, "6411:1", 2},
    {"analog-io", "1401", 2, "6411:2", 2},
    {"drive", "1400", 1, "6040:0", 2},
    {"drive", "1400", 2, "6060:0", 1},
    {"drive", "1401", 1, "607A:0", 4},
    {"drive", "1401", 2, "60FF:0", 4},
}};

// A device with PDOs of 64 bytes, which are objects of one byte.
constexpr unsigned kFdBytes = 64;
bool has_long_pdo(const Device& device) {
  return device.profile == "fd-io";
}

struct Output {
  const char* record;
  unsigned sub;
  std::string object;
  unsigned bytes;
};

std::vector<Output> mapped_by(const Device& device) {
  std::vector<Output> out;
  for (const OutputRow& row : kOutputs) {
    if (row.profile == device.profile) {
      out.push_back({row.record, row.sub, row.object, row.bytes});
    }
  }
  for (unsigned sub = 1; has_long_pdo(device) && sub <= kFdBytes; ++sub) {
    out.push_back({"1400", sub, "6200:" + std::to_string(sub), 1});
  }
  return out;
}

}  // namespace

void give_pdos(std::ostream& out, std::mt19937_64& random, const Device& device,
               unsigned bit_rate) {
  const auto below = [&random](unsigned limit) { return static_cast<unsigned>(random() % limit); };
  for (const Output& output : mapped_by(device)) {
    if (output.sub > 1) {
      continue;
    }
    constexpr std::array<unsigned, 3> kSynchronous{0, 1, 3};
    constexpr unsigned kEventDriven = 255;
    // A slow bus has not enough bandwidth for synchronous PDOs of many devices.
    const bool synchronous = below(4) == 0 && bit_rate == 1'000'000;
    const unsigned type = synchronous ? kSynchronous[below(3)] : kEventDriven;
    out << " expected " << output.record << ":2 " << type << " write " << output.record << ":2 "
        << (synchronous ? "0" : "") << std::hex << std::uppercase << type << std::dec;
    if (!synchronous && below(4) == 0) {
      out << " inhibit " << output.record << ' ' << 5 + below(100) << "ms";
    }
  }
}

void give_values(std::ostream& out, std::mt19937_64& random, const Device& device) {
  const auto below = [&random](unsigned limit) { return static_cast<unsigned>(random() % limit); };
  // Most writes have all values of a PDO.
  const unsigned missing = has_long_pdo(device) ? 6 * kFdBytes : 12;
  for (const Output& output : mapped_by(device)) {
    if (below(missing) != 0) {
      out << ' ' << device.id << '.' << output.object << " = ";
      for (unsigned i = 0; i < output.bytes; ++i) {
        out << (below(2) == 0 ? "11" : "2E");
      }
    }
  }
}

std::vector<std::pair<std::string, unsigned>> outputs_of(const Device& device) {
  std::vector<std::pair<std::string, unsigned>> out;
  for (const Output& output : mapped_by(device)) {
    out.emplace_back(output.object, output.bytes);
  }
  return out;
}

void give_numbered(std::ostream& out, const Device& device, unsigned number) {
  constexpr const char* kDigits = "0123456789ABCDEF";
  for (const Output& output : mapped_by(device)) {
    out << ' ' << device.id << '.' << output.object << " = ";
    for (unsigned i = 0; i < output.bytes; ++i) {
      const unsigned byte = i < sizeof number ? number >> (8 * i) & 0xFFU : 0U;
      out << kDigits[byte >> 4U] << kDigits[byte & 0xFU];
    }
  }
}

}  // namespace linegate::plant
