// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/names/random_device.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>

#include "tests/gateway/names/meaning.h"

namespace linegate::names {
namespace {

using od::DataType;

constexpr std::array<std::string_view, 8> kWords{"Valve",   "24V (aux)", "class", "x  --  y",
                                                 "Druck/p", "_flag_",    "A.B",   "\xC3\xA4 Wert"};

std::uint64_t low(std::uint64_t value, unsigned bits) {
  return bits == 64 ? value : value % (std::uint64_t{1} << bits);
}

// Of an object of that type with at most `room` bits left in the PDO; 0: it has no room.
unsigned mapped_bits(Random& random, const CiaType& type, unsigned room) {
  unsigned bits = type.bits;
  if (type.type == DataType::boolean)
    bits = pick(random, 0, 3) == 0 ? 8 : 1;
  else if (bits == 0)
    bits = static_cast<unsigned>(pick(random, 1, 64 / type.unit)) * type.unit;
  return bits > room ? 0 : bits;
}

// Also units of UTF-16 that are half a pair.
std::uint64_t random_text(Random& random, unsigned bits, unsigned width, bool writable) {
  std::uint64_t out = 0;
  const auto length = pick(random, 0, bits / width);
  for (unsigned i = 0; i < length; ++i) {
    std::uint64_t unit = pick(random, 1, 0xFF);
    if (width == 16 && pick(random, 0, 1) == 0)
      unit = pick(random, writable ? 0xE000 : 0xD800, 0xFFFF);
    if (!writable && pick(random, 0, 7) == 0)
      unit = 0;
    if (width == 16 && i + 1 < length && pick(random, 0, 2) == 0) {
      out |= pick(random, 0xD800, 0xDBFF) << 16 * i;
      unit = pick(random, 0xDC00, 0xDFFF);
      ++i;
    }
    out |= unit << width * i;
  }
  return out;
}

std::uint64_t random_real(Random& random, unsigned bits, bool writable) {
  const std::array<std::uint64_t, 8> wide{0,
                                          0x8000'0000'0000'0000,
                                          0x7FF0'0000'0000'0000,
                                          0xFFF0'0000'0000'0000,
                                          0x7FF8'0000'0000'0000,
                                          0x7FEF'FFFF'FFFF'FFFF,
                                          1,
                                          0xBFB9'9999'9999'999A};
  const std::array<std::uint64_t, 8> narrow{0,           0x8000'0000, 0x7F80'0000, 0xFF80'0000,
                                            0x7FC0'0000, 0x7F7F'FFFF, 1,           0xBFC0'0000};
  if (pick(random, 0, 1) == 0)
    return (bits == 64 ? wide : narrow)[pick(random, 0, 7)];
  const std::uint64_t any = low(random(), bits);
  const std::uint64_t exponent = bits == 64 ? 0x7FF0'0000'0000'0000 : 0x7F80'0000;
  return writable && (any & exponent) == exponent ? any & ~exponent : any;
}

std::string digits(unsigned value, int width) {
  std::array<char, 12> out{};
  std::snprintf(out.data(), out.size(), "%0*X", width, value);
  return out.data();
}

class EdsText {
 public:
  EdsText() {
    text_ =
        "[FileInfo]\nFileName=random.eds\n[DeviceInfo]\nVendorName=Test\nProductName=Random\n"
        "Granularity=1\n[MandatoryObjects]\nSupportedObjects=2\n1=0x1000\n2=0x1001\n";
    variable("1000", "Device type", DataType::unsigned32, "ro", "0");
    variable("1001", "Error register", DataType::unsigned8, "ro", "0");
    add("1017", "Heartbeat time", DataType::unsigned16, "rw");
  }
  void add(const std::string& index, const std::string& name, DataType type, const char* access) {
    indices_.push_back(index);
    variable(index, name, type, access, index == "1017" ? "0" : "", true);
  }
  void add(const RandomPdo& pdo, bool is_input) {
    const std::string communication = digits((is_input ? 0x17FFU : 0x13FFU) + pdo.number, 4);
    record(communication, 3);
    variable(communication + "sub0", "Count", DataType::unsigned8, "const", "2");
    variable(communication + "sub1", "COB-ID", DataType::unsigned32, "rw",
             "0x" + digits(pdo.identifier | (is_input ? 0x4000'0000U : 0), 8));
    variable(communication + "sub2", "Type", DataType::unsigned8, "rw", "254");
    const std::string mapping = digits((is_input ? 0x19FFU : 0x15FFU) + pdo.number, 4);
    record(mapping, static_cast<unsigned>(pdo.mapped.size()) + 1);
    variable(mapping + "sub0", "Count", DataType::unsigned8, "rw",
             std::to_string(pdo.mapped.size()));
    for (unsigned i = 0; i < pdo.mapped.size(); ++i)
      variable(mapping + "sub" + digits(i + 1, 1), "Mapped", DataType::unsigned32, "rw",
               "0x" + digits(pdo.mapped[i].object.index * 0x1'0000U + pdo.mapped[i].bits, 8));
  }
  std::string take() {
    text_ += "[OptionalObjects]\nSupportedObjects=" + std::to_string(indices_.size()) + '\n';
    for (std::size_t i = 0; i < indices_.size(); ++i)
      text_ += std::to_string(i + 1) + "=0x" + indices_[i] + '\n';
    return text_;
  }

 private:
  void record(const std::string& index, unsigned subs) {
    indices_.push_back(index);
    text_ += '[' + index + "]\nParameterName=PDO\nObjectType=9\nSubNumber=" + std::to_string(subs) +
             '\n';
  }
  void variable(const std::string& section, const std::string& name, DataType type,
                const char* access, const std::string& value, bool mapped = false) {
    text_ += '[' + section + "]\nParameterName=" + name +
             "\nObjectType=7\nDataType=" + std::to_string(static_cast<unsigned>(type)) +
             "\nAccessType=" + access + '\n' +
             (value.empty() ? "" : "DefaultValue=" + value + '\n') +
             (mapped ? "PDOMapping=1\n" : "");
  }

  std::string text_;
  std::vector<std::string> indices_;
};

// Up to 64 bits; an object is in a PDO once.
RandomPdo random_pdo(Random& random, std::vector<RandomObject>& objects, bool is_input,
                     std::uint16_t& index) {
  RandomPdo pdo;
  for (auto tries = pick(random, 1, 12); tries > 0; --tries) {
    RandomObject object;
    // An input may be in several PDOs.
    if (is_input && !objects.empty() && pick(random, 0, 9) == 0)
      object = objects[pick(random, 0, objects.size() - 1)];
    const bool again = std::ranges::any_of(
        pdo.mapped, [&](const Mapped& one) { return one.object.index == object.index; });
    if (object.index == 0 || again) {
      object.index = index;
      object.type = kCiaTypes[pick(random, 0, kCiaTypes.size() - 1)].type;
      object.name =
          std::string(kWords[pick(random, 0, kWords.size() - 1)]) + " " + digits(object.index, 1);
    }
    const unsigned bits = mapped_bits(random, cia_type(object.type), 64 - pdo.bits());
    if (bits == 0)
      continue;
    pdo.mapped.push_back({object, bits, pdo.bits()});
    if (object.index == index) {
      objects.push_back(object);
      ++index;
    }
  }
  return pdo;
}

}  // namespace

std::uint64_t pick(Random& random, std::uint64_t least, std::uint64_t most) {
  return least + random() % (most - least + 1);
}

std::uint64_t Mapped::random_value(Random& random, bool writable) const {
  const DataType type = object.type;
  const unsigned size = value_bits();
  if (cia_type(type).number == Number::real)
    return random_real(random, size, writable);
  if (type == DataType::visible_string)
    return random_text(random, size, 8, writable);
  if (type == DataType::unicode_string)
    return random_text(random, size, 16, writable);
  if (type == DataType::time_of_day || type == DataType::time_difference)
    return writable ? pick(random, 0, 86'399'999) | pick(random, 0, 0xFFFF) << 32U
                    : low(random(), size);
  const std::uint64_t most = low(~std::uint64_t{0}, size);
  const std::array<std::uint64_t, 4> limits{0, most, most / 2, most - most / 2};
  const std::uint64_t choice = pick(random, 0, 7);
  return choice < limits.size() ? limits[choice] : low(random(), size);
}

unsigned RandomPdo::bits() const {
  return mapped.empty() ? 0 : mapped.back().offset + mapped.back().bits;
}

std::string RandomDevice::eds() const {
  EdsText text;
  std::vector<std::uint16_t> known;
  for (const bool is_input : {true, false}) {
    for (const RandomPdo& pdo : is_input ? inputs : outputs) {
      text.add(pdo, is_input);
      for (const Mapped& one : pdo.mapped) {
        if (std::ranges::find(known, one.object.index) == known.end())
          text.add(digits(one.object.index, 4), one.object.name, one.object.type,
                   is_input ? "ro" : "rw");
        known.push_back(one.object.index);
      }
    }
  }
  return text.take();
}

RandomDevice random_device(Random& random, std::uint32_t& identifier) {
  RandomDevice out;
  std::vector<RandomObject> objects;
  std::uint16_t index = 0x2001;
  for (const bool is_input : {true, false}) {
    std::vector<RandomPdo>& pdos = is_input ? out.inputs : out.outputs;
    for (auto count = pick(random, 1, 6); count > 0; --count) {
      RandomPdo pdo = random_pdo(random, objects, is_input, index);
      if (pdo.mapped.empty())
        continue;
      pdo.number = static_cast<std::uint16_t>(pdos.size() + 1);
      pdo.identifier = identifier++;
      pdos.push_back(pdo);
    }
  }
  return out;
}

}  // namespace linegate::names
