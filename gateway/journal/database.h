// SPDX-License-Identifier: Apache-2.0
// Connections and statements of SQLite 3. Results are its extended result codes: SQLITE_OK is 0.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/exchange/cell.h"

struct sqlite3;
struct sqlite3_stmt;

namespace linegate::gateway {

// A prepared statement. Errors of bind() are returned by the next step().
class Statement {
 public:
  // Invalid if the text cannot be prepared: step() then returns the error.
  Statement(sqlite3* database, std::string_view text);

  // The parameter at that position, from 1 on.
  void bind(int position, std::int64_t value);
  void bind(int position, double value);
  void bind_null(int position);
  // The bytes must exist until reset().
  void bind(int position, std::string_view text);
  void bind(int position, std::span<const std::byte> data);

  // SQLITE_ROW, SQLITE_DONE or an error.
  int step();
  // Executes a statement without rows, and resets it. 0 or an error.
  int run();
  void reset();

  // Columns of the present row, from 0 on.
  std::int64_t number(int column) const;
  double real(int column) const;
  std::string text(int column) const;
  std::vector<std::byte> data(int column) const;

 private:
  struct Finalise {
    void operator()(sqlite3_stmt* statement) const;
  };
  std::unique_ptr<sqlite3_stmt, Finalise> statement_;
  int error_ = 0;  // of the preparation or of a parameter
};

// A connection, for one thread at a time.
class Database {
 public:
  enum class Use : std::uint8_t {
    write,       // creates a file that is missing
    read,        // beside other processes; SQLite may have to create files beside it
    read_alone,  // no process writes the file
  };

  // 0 or an error.
  int open(const std::string& file, Use use);
  void close();
  bool is_open() const { return connection_ != nullptr; }
  sqlite3* get() const { return connection_.get(); }

  // Ends statements with SQLITE_INTERRUPT while the flag is raised. It must exist while this is
  // open.
  void stop_when(const exchange::Flag& flag);

  // Executes statements without results. 0 or an error.
  int execute(const char* statements);
  // The first column of the first row. Nothing if there is no row, or an error.
  std::optional<std::int64_t> number(std::string_view query, int& error);
  std::optional<std::string> text(std::string_view query, int& error);

 private:
  struct Close {
    void operator()(sqlite3* connection) const;
  };
  std::unique_ptr<sqlite3, Close> connection_;
};

// Whether the code says that the contents of the file are not those of a journal.
bool is_unusable(int error);
// The words of SQLite for a result code.
std::string error_text(int error);

}  // namespace linegate::gateway
