// SPDX-License-Identifier: Apache-2.0
// Loading an EDS: from the file on disk, which is in the page cache, to the description of the
// device. The file is generated: a fifth of its objects are arrays of 8 elements, all others have
// one value. The peer reads the same file and splits it into lines.
#include <algorithm>
#include <chrono>
#include <deque>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <unistd.h>

#include "stack/base/byte_order.h"
#include "stack/eds/reader.h"
#include "stack/eds/writer.h"

#include "tests/bench/measure.h"

namespace {

using namespace linegate;
using bench::Contestant;

constexpr std::uint16_t kFirst = 0x2000;
constexpr std::uint8_t kElements = 8;
constexpr double kMega = 1e6;

od::VariableDescription variable(std::uint8_t sub, std::string name, od::DataType type,
                                 std::uint64_t value) {
  od::VariableDescription out{.sub = sub,
                              .name = std::move(name),
                              .type = type,
                              .access = sub == 0 && type == od::DataType::unsigned8
                                            ? od::Access::constant
                                            : od::Access::rw};
  out.value.resize(od::byte_size(type));
  store_le(std::span(out.value), value);
  return out;
}

std::string generate(std::size_t objects) {
  od::DeviceDescription device;
  device.vendor_name = "Bench";
  for (std::size_t i = 0; i < objects; ++i) {
    od::ObjectDescription object{.index = static_cast<std::uint16_t>(kFirst + i),
                                 .name = "Parameter " + std::to_string(i)};
    if (i % 5 != 0) {
      object.variables = {variable(0, object.name, od::DataType::unsigned32, i)};
    } else {
      object.type = od::ObjectType::array;
      object.variables = {variable(0, "Number of elements", od::DataType::unsigned8, kElements)};
      for (std::uint8_t sub = 1; sub <= kElements; ++sub) {
        object.variables.push_back(
            variable(sub, "Element " + std::to_string(sub), od::DataType::unsigned16, i + sub));
      }
    }
    device.objects.push_back(std::move(object));
  }
  return eds::write_eds(eds::sheet_of(std::move(device)));
}

class File {
 public:
  explicit File(std::size_t objects)
      : objects_(objects),
        path_(std::filesystem::temp_directory_path() /
              ("linegate-bench-" + std::to_string(getpid()) + "-" + std::to_string(objects))) {
    const std::string text = generate(objects);
    std::ofstream(path_, std::ios::binary) << text;
    size_ = text.size();
    lines_ = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  }
  ~File() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  std::size_t size() const { return size_; }
  std::size_t objects() const { return objects_; }

  double split() const {
    return rate([this] {
      const std::string text = contents();
      std::vector<std::string_view> lines;
      for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        lines.emplace_back(text.data() + begin, end - begin);
        begin = end + 1;
      }
      bench::require(lines.size() == lines_, "the number of lines differs");
    });
  }
  double load() const {
    return rate([this] {
      const auto loaded = eds::load(contents(), "generated.eds", 1);
      bench::require(loaded.ok() && loaded.diagnostics.empty(), "the file has errors or warnings");
      bench::require(loaded.value->objects.size() == objects_, "objects are missing");
    });
  }

 private:
  std::string contents() const {
    std::string text(size_, '\0');
    std::ifstream file(path_, std::ios::binary);
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    bench::require(file.good(), "the file cannot be read");
    return text;
  }
  // Returns MB per second.
  template <class Work>
  double rate(Work work) const {
    const auto begin = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
    return static_cast<double>(size_) / spent.count() / kMega;
  }

  std::size_t objects_;
  std::filesystem::path path_;
  std::size_t size_ = 0;
  std::size_t lines_ = 0;
};

}  // namespace

int main() {
  std::deque<File> files;
  std::vector<Contestant> contestants;  // peer and reader for each file
  for (const std::size_t objects : {std::size_t{1000}, std::size_t{10'000}}) {
    const File& file = files.emplace_back(objects);
    const std::string of = ", " + std::to_string(objects) + " objects in " +
                           std::to_string(file.size() / 1000) + " kB";
    contestants.push_back({"peer: lines" + of, [&file] { return file.split(); }, {}});
    contestants.push_back({"EDS loaded" + of, [&file] { return file.load(); }, {}});
  }
  bench::interleave(contestants);

  bench::print_heading("Loading an EDS");
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    const File& file = files[i / 2];
    const double a_second = bench::median(contestants[i].figures) * kMega *
                            static_cast<double>(file.objects()) / static_cast<double>(file.size());
    const double ratio = bench::median_ratio(contestants[i & ~std::size_t{1}], contestants[i]);
    bench::print_figure(contestants[i], "MB/s",
                        i % 2 == 0
                            ? ""
                            : ", " + std::to_string(static_cast<long>(a_second)) + " objects/s, " +
                                  std::to_string(ratio).substr(0, 4) + " x the time of the peer");
  }
}
