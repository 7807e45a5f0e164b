// SPDX-License-Identifier: Apache-2.0
// A disk that loses what was not synchronised: the writes of SQLite are recorded, and the files of
// any moment of a power failure are made from the record.
//
// The model: a write is persistent at the latest when the file is synchronised. Until then each of
// its sectors (512 bytes) is persistent or not, independent of all others and of their order. The
// same holds for the new size of a truncated file. The creation and the removal of a file are
// persistent when its folder is synchronised, which the VFS does at the first synchronisation of a
// new log or journal, or when the file is synchronised.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <sqlite3.h>

namespace linegate::gateway {

// The default VFS of SQLite while it exists. Works on the real files; for one thread. Files whose
// name ends with "-shm" are not recorded: SQLite makes them anew.
class RecordedDisk {
 public:
  enum class Sync : std::uint8_t {
    honest,
    ignored,  // of a disk that confirms before it has written
  };

  RecordedDisk();
  ~RecordedDisk();
  RecordedDisk(const RecordedDisk&) = delete;
  RecordedDisk& operator=(const RecordedDisk&) = delete;

  // Forgets the record. Records the files of that folder only; those that exist are persistent.
  void begin(const std::string& folder);
  // Operations since begin().
  std::size_t operations() const { return operations_.size(); }

  // Contents by the name of the file, without its folder.
  using Files = std::map<std::string, std::string>;
  // After a power failure that followed the first `operations` operations.
  Files cut(std::size_t operations, Sync sync, std::mt19937& random) const;

 private:
  struct Operation {
    enum class Kind : std::uint8_t {
      create,
      write,
      truncate,
      sync,
      sync_folder,
      remove,
    };
    Kind kind{};
    std::string file;
    std::int64_t offset = 0;  // or the size
    std::string bytes;
  };
  // A file in memory.
  struct State {
    std::optional<std::string> persistent;  // nothing: it does not exist
    std::vector<const Operation*> pending;
  };
  struct File;  // of SQLite

  static void sync_folder(State& state);
  static void sync_file(State& state);
  static std::optional<std::string> settle(const State& state, std::mt19937& random);
  static void apply(const Operation& operation, std::string& to);
  static void apply_sectors(const Operation& write, std::string& to, unsigned of_eight,
                            std::mt19937& random);
  static int open(sqlite3_vfs* self, const char* name, sqlite3_file* file, int flags, int* out);
  static int remove(sqlite3_vfs* self, const char* name, int synchronise);
  static sqlite3_io_methods methods();
  static void record(Operation::Kind kind, const std::string& file, std::int64_t offset = 0,
                     std::string bytes = {});
  static bool is_recorded(const char* name);
  static sqlite3_file* real(sqlite3_file* file);

  static inline RecordedDisk* self_ = nullptr;
  sqlite3_vfs* real_;
  sqlite3_vfs vfs_{};
  sqlite3_io_methods methods_;
  std::string folder_;  // of recorded files
  Files files_;         // at begin()
  std::vector<Operation> operations_;
};

}  // namespace linegate::gateway
