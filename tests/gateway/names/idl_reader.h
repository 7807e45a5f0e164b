// SPDX-License-Identifier: Apache-2.0
// CDR of the structs in an IDL document, as text: what a compiler of IDL generates code for.
// Written from the IDL alone: it uses nothing of bridges/named.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace linegate::names {

class IdlReader {
 public:
  // The document, as `linegate idl` prints it.
  explicit IdlReader(const std::string& idl);

  // By path ("values.Flag"), each member in the form of meaning.h. Empty if the sample is not
  // exactly as long as the type needs.
  std::map<std::string, std::string> read(const std::string& type,
                                          std::span<const std::byte> sample) const;
  // The reverse; what is not in `values` is 0 or empty.
  std::vector<std::byte> write(const std::string& type,
                               const std::map<std::string, std::string>& values) const;

 private:
  struct Member {
    std::string type;
    std::string name;
    std::size_t count = 0;  // of an array
  };
  struct Cursor;

  void read_struct(const std::string& type, const std::string& path, Cursor& from,
                   std::map<std::string, std::string>& to) const;
  void write_struct(const std::string& type, const std::string& path,
                    const std::map<std::string, std::string>& from, Cursor& to) const;

  std::map<std::string, std::vector<Member>> structs_;
};

}  // namespace linegate::names
