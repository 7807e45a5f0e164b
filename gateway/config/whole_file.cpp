#include "gateway/config/whole_file.h"

#include <array>
#include <fstream>
#include <utility>

namespace linegate::config {

// An error while it is read throws out of iterators of stream buffers, but not out of read(), which
// then is bad and not at its end.
std::optional<std::string> whole_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string out;
  std::array<char, 4096> part;
  while (in.read(part.data(), part.size()) || in.gcount() > 0) {
    out.append(part.data(), static_cast<std::size_t>(in.gcount()));
  }
  return in.eof() ? std::optional(std::move(out)) : std::nullopt;
}

}  // namespace linegate::config
