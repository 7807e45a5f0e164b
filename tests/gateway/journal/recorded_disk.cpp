// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/journal/recorded_disk.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

namespace linegate::gateway {
namespace {

constexpr std::int64_t kSector = 512;

// The contents of a file, which is empty if it did not exist.
std::string& contents_of(std::optional<std::string>& file) {
  return file ? *file : file.emplace();
}

std::string name_of(const std::string& path) {
  return std::filesystem::path(path).filename().string();
}

}  // namespace

// The file of the real VFS follows it.
struct RecordedDisk::File {
  sqlite3_file base;
  std::string* name;  // owned; nullptr: not recorded
  bool syncs_folder;
};

RecordedDisk::RecordedDisk() : real_(sqlite3_vfs_find(nullptr)), vfs_(*real_), methods_(methods()) {
  self_ = this;
  vfs_.zName = "recorded";
  vfs_.szOsFile = real_->szOsFile + static_cast<int>(sizeof(File));
  vfs_.xOpen = &RecordedDisk::open;
  vfs_.xDelete = &RecordedDisk::remove;
  sqlite3_vfs_register(&vfs_, 1);
}

RecordedDisk::~RecordedDisk() {
  sqlite3_vfs_register(real_, 1);
  sqlite3_vfs_unregister(&vfs_);
  self_ = nullptr;
}

void RecordedDisk::begin(const std::string& folder) {
  folder_ = folder;
  operations_.clear();
  files_.clear();
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (entry.is_regular_file() && !name.ends_with("-shm") && !name.ends_with(".lock")) {
      std::ifstream file(entry.path(), std::ios::binary);
      files_[name] = {std::istreambuf_iterator<char>(file), {}};
    }
  }
}

void RecordedDisk::record(Operation::Kind kind, const std::string& file, std::int64_t offset,
                          std::string bytes) {
  self_->operations_.push_back({kind, file, offset, std::move(bytes)});
}

sqlite3_file* RecordedDisk::real(sqlite3_file* file) {
  return reinterpret_cast<sqlite3_file*>(reinterpret_cast<File*>(file) + 1);
}

bool RecordedDisk::is_recorded(const char* name) {
  return name != nullptr && std::filesystem::path(name).parent_path() == self_->folder_;
}

int RecordedDisk::open(sqlite3_vfs* /*self*/, const char* name, sqlite3_file* file, int flags,
                       int* out) {
  auto* const made = reinterpret_cast<File*>(file);
  made->base.pMethods = nullptr;
  made->name = nullptr;
  made->syncs_folder = false;
  const bool exists = name != nullptr && std::filesystem::exists(name);
  const int error = self_->real_->xOpen(self_->real_, name, real(file), flags, out);
  if (real(file)->pMethods == nullptr) {
    return error;
  }
  made->base.pMethods = &self_->methods_;
  if (error == SQLITE_OK && is_recorded(name)) {
    made->name = new std::string(name_of(name));
    if (!exists) {
      made->syncs_folder = (flags & (SQLITE_OPEN_WAL | SQLITE_OPEN_MAIN_JOURNAL)) != 0;
      record(Operation::Kind::create, *made->name);
    }
  }
  return error;
}

int RecordedDisk::remove(sqlite3_vfs* /*self*/, const char* name, int synchronise) {
  const int error = self_->real_->xDelete(self_->real_, name, 0);
  if (error == SQLITE_OK && is_recorded(name)) {
    record(Operation::Kind::remove, name_of(name));
    if (synchronise != 0) {
      record(Operation::Kind::sync_folder, {});
    }
  }
  return error;
}

// Version 2: without memory maps of the database, whose writes could not be recorded.
sqlite3_io_methods RecordedDisk::methods() {
  using F = sqlite3_file;
  sqlite3_io_methods to{};
  to.iVersion = 2;
  to.xClose = [](F* f) {
    delete reinterpret_cast<File*>(f)->name;
    return real(f)->pMethods->xClose(real(f));
  };
  to.xRead = [](F* f, void* bytes, int size, sqlite3_int64 offset) {
    return real(f)->pMethods->xRead(real(f), bytes, size, offset);
  };
  to.xWrite = [](F* f, const void* bytes, int size, sqlite3_int64 offset) {
    if (const std::string* const name = reinterpret_cast<File*>(f)->name; name != nullptr) {
      record(Operation::Kind::write, *name, offset,
             {static_cast<const char*>(bytes), static_cast<std::size_t>(size)});
    }
    return real(f)->pMethods->xWrite(real(f), bytes, size, offset);
  };
  to.xTruncate = [](F* f, sqlite3_int64 size) {
    if (const std::string* const name = reinterpret_cast<File*>(f)->name; name != nullptr) {
      record(Operation::Kind::truncate, *name, size);
    }
    return real(f)->pMethods->xTruncate(real(f), size);
  };
  to.xSync = [](F* f, int /*flags*/) {
    if (const std::string* const name = reinterpret_cast<File*>(f)->name; name != nullptr) {
      record(Operation::Kind::sync, *name);
      if (std::exchange(reinterpret_cast<File*>(f)->syncs_folder, false)) {
        record(Operation::Kind::sync_folder, {});
      }
    }
    return SQLITE_OK;  // nothing has to reach the real disk: the record is the disk of the test
  };
  to.xFileSize = [](F* f, sqlite3_int64* size) {
    return real(f)->pMethods->xFileSize(real(f), size);
  };
  to.xLock = [](F* f, int lock) { return real(f)->pMethods->xLock(real(f), lock); };
  to.xUnlock = [](F* f, int lock) { return real(f)->pMethods->xUnlock(real(f), lock); };
  to.xCheckReservedLock = [](F* f, int* out) {
    return real(f)->pMethods->xCheckReservedLock(real(f), out);
  };
  // Without the hint of the size, which would extend the file unrecorded
  to.xFileControl = [](F* f, int what, void* argument) {
    return what == SQLITE_FCNTL_SIZE_HINT || what == SQLITE_FCNTL_CHUNK_SIZE
               ? SQLITE_OK
               : real(f)->pMethods->xFileControl(real(f), what, argument);
  };
  to.xSectorSize = [](F* f) { return real(f)->pMethods->xSectorSize(real(f)); };
  to.xDeviceCharacteristics = [](F* f) {
    return real(f)->pMethods->xDeviceCharacteristics(real(f));
  };
  to.xShmMap = [](F* f, int region, int size, int extend, void volatile** out) {
    return real(f)->pMethods->xShmMap(real(f), region, size, extend, out);
  };
  to.xShmLock = [](F* f, int offset, int count, int flags) {
    return real(f)->pMethods->xShmLock(real(f), offset, count, flags);
  };
  to.xShmBarrier = [](F* f) { real(f)->pMethods->xShmBarrier(real(f)); };
  to.xShmUnmap = [](F* f, int discard) { return real(f)->pMethods->xShmUnmap(real(f), discard); };
  return to;
}

void RecordedDisk::apply(const Operation& operation, std::string& to) {
  if (operation.kind == Operation::Kind::truncate) {
    to.resize(static_cast<std::size_t>(operation.offset));
    return;
  }
  const auto from = static_cast<std::size_t>(operation.offset);
  to.resize(std::max(to.size(), from + operation.bytes.size()));
  std::ranges::copy(operation.bytes, to.begin() + operation.offset);
}

void RecordedDisk::apply_sectors(const Operation& write, std::string& to, unsigned of_eight,
                                 std::mt19937& random) {
  const std::int64_t end = write.offset + static_cast<std::int64_t>(write.bytes.size());
  for (std::int64_t from = write.offset; from < end;) {
    const std::int64_t until = std::min(end, (from / kSector + 1) * kSector);
    if (random() % 8 < of_eight) {
      const auto first = static_cast<std::size_t>(from - write.offset);
      apply({Operation::Kind::write,
             {},
             from,
             write.bytes.substr(first, static_cast<std::size_t>(until - from))},
            to);
    }
    from = until;
  }
}

// The newest creation or removal is persistent, the writes after it are not.
void RecordedDisk::sync_folder(State& state) {
  const auto is_of_folder = [](const Operation* one) {
    return one->kind == Operation::Kind::create || one->kind == Operation::Kind::remove;
  };
  const auto newest = std::find_if(state.pending.rbegin(), state.pending.rend(), is_of_folder);
  if (newest == state.pending.rend()) {
    return;
  }
  state.persistent =
      (*newest)->kind == Operation::Kind::create ? std::optional<std::string>("") : std::nullopt;
  state.pending.erase(state.pending.begin(), newest.base());
}

void RecordedDisk::sync_file(State& state) {
  for (const Operation* written : std::exchange(state.pending, {})) {
    if (written->kind == Operation::Kind::remove) {
      state.persistent.reset();
      continue;
    }
    std::string& contents = contents_of(state.persistent);
    if (written->kind != Operation::Kind::create) {
      apply(*written, contents);
    }
  }
  (void)contents_of(state.persistent);
}

std::optional<std::string> RecordedDisk::settle(const State& state, std::mt19937& random) {
  // From nothing to everything, and between: a file may have lost all of it, or one sector
  const auto of_eight = static_cast<unsigned>(random() % 9);
  std::optional<std::string> out = state.persistent;
  for (const Operation* operation : state.pending) {
    const bool done = random() % 8 < of_eight;
    if (operation->kind == Operation::Kind::write) {
      if (out || done) {
        apply_sectors(*operation, contents_of(out), of_eight, random);
      }
    } else if (done && operation->kind == Operation::Kind::remove) {
      out.reset();
    } else if (done && operation->kind == Operation::Kind::create) {
      (void)contents_of(out);
    } else if (done && out && operation->kind == Operation::Kind::truncate) {
      apply(*operation, *out);
    }
  }
  return out;
}

RecordedDisk::Files RecordedDisk::cut(std::size_t operations, Sync sync,
                                      std::mt19937& random) const {
  std::map<std::string, State> states;
  for (const auto& [name, contents] : files_) {
    states[name].persistent = contents;
  }
  for (const Operation& operation : std::span(operations_).first(operations)) {
    if (operation.kind == Operation::Kind::sync_folder) {
      for (auto& [name, state] : states) {
        if (sync == Sync::honest) {
          sync_folder(state);
        }
      }
    } else if (operation.kind != Operation::Kind::sync) {
      states[operation.file].pending.push_back(&operation);
    } else if (sync == Sync::honest) {
      sync_file(states[operation.file]);
    }
  }
  Files out;
  for (const auto& [name, state] : states) {
    if (auto contents = settle(state, random)) {
      out[name] = std::move(*contents);
    }
  }
  return out;
}

}  // namespace linegate::gateway
