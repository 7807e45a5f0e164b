// SPDX-License-Identifier: Apache-2.0
#include "gateway/journal/database.h"

#include <cctype>

#include <fmt/format.h>
#include <sqlite3.h>

namespace linegate::gateway {
namespace {

// Waits for readers of the same file, which never hold a lock for long.
constexpr int kBusyMs = 200;

// A path as an URI of SQLite.
std::string uri_of(const std::string& file) {
  std::string out = "file:";
  for (const char c : file) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain =
        std::isalnum(byte) != 0 || std::string_view("/._-").find(c) != std::string_view::npos;
    out += plain ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  return out;
}

}  // namespace

void Statement::Finalise::operator()(sqlite3_stmt* statement) const {
  sqlite3_finalize(statement);
}

Statement::Statement(sqlite3* database, std::string_view text) {
  sqlite3_stmt* made = nullptr;
  error_ = sqlite3_prepare_v2(database, text.data(), static_cast<int>(text.size()), &made, nullptr);
  statement_.reset(made);
}

void Statement::bind(int position, std::int64_t value) {
  if (const int error = sqlite3_bind_int64(statement_.get(), position, value); error != 0) {
    error_ = error;
  }
}

void Statement::bind(int position, double value) {
  const int error = sqlite3_bind_double(statement_.get(), position, value);
  error_ = error != 0 ? error : error_;
}

void Statement::bind_null(int position) {
  const int error = sqlite3_bind_null(statement_.get(), position);
  error_ = error != 0 ? error : error_;
}

void Statement::bind(int position, std::string_view text) {
  const int error = sqlite3_bind_text(statement_.get(), position, text.data(),
                                      static_cast<int>(text.size()), SQLITE_STATIC);
  error_ = error != 0 ? error : error_;
}

void Statement::bind(int position, std::span<const std::byte> data) {
  // A null pointer would be NULL and not an empty value
  const void* const begin = data.empty() ? "" : static_cast<const void*>(data.data());
  const int error = sqlite3_bind_blob(statement_.get(), position, begin,
                                      static_cast<int>(data.size()), SQLITE_STATIC);
  error_ = error != 0 ? error : error_;
}

int Statement::step() {
  return error_ != 0 ? error_ : sqlite3_step(statement_.get());
}

int Statement::run() {
  const int result = step();
  reset();
  return result == SQLITE_DONE || result == SQLITE_ROW ? SQLITE_OK : result;
}

void Statement::reset() {
  sqlite3_reset(statement_.get());
}

std::int64_t Statement::number(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

double Statement::real(int column) const {
  return sqlite3_column_double(statement_.get(), column);
}

std::string Statement::text(int column) const {
  const auto* const text =
      reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return text == nullptr ? std::string() : std::string(text, static_cast<std::size_t>(size));
}

std::vector<std::byte> Statement::data(int column) const {
  const auto* const data =
      static_cast<const std::byte*>(sqlite3_column_blob(statement_.get(), column));
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return data == nullptr ? std::vector<std::byte>() : std::vector<std::byte>(data, data + size);
}

void Database::Close::operator()(sqlite3* connection) const {
  sqlite3_close_v2(connection);
}

int Database::open(const std::string& file, Use use) {
  close();
  const bool alone = use == Use::read_alone;
  const int flags =
      SQLITE_OPEN_NOMUTEX | (alone ? SQLITE_OPEN_URI : 0) |
      (use == Use::write ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY);
  const std::string name = alone ? uri_of(file) + "?immutable=1" : file;
  sqlite3* made = nullptr;
  const int error = sqlite3_open_v2(name.c_str(), &made, flags, nullptr);
  connection_.reset(made);
  if (error != SQLITE_OK) {
    close();
    return error;
  }
  sqlite3_extended_result_codes(made, 1);
  sqlite3_busy_timeout(made, kBusyMs);
  return SQLITE_OK;
}

void Database::stop_when(const exchange::Flag& flag) {
  constexpr int kSteps = 1000;  // of a statement, between two looks at the flag
  const auto is_raised = [](void* of) {
    return static_cast<const exchange::Flag*>(of)->raised() ? 1 : 0;
  };
  sqlite3_progress_handler(connection_.get(), kSteps, is_raised,
                           const_cast<exchange::Flag*>(&flag));
}

void Database::close() {
  connection_.reset();
}

int Database::execute(const char* statements) {
  return sqlite3_exec(connection_.get(), statements, nullptr, nullptr, nullptr);
}

std::optional<std::int64_t> Database::number(std::string_view query, int& error) {
  Statement statement(connection_.get(), query);
  const int result = statement.step();
  error = result == SQLITE_ROW || result == SQLITE_DONE ? SQLITE_OK : result;
  return result == SQLITE_ROW ? std::optional(statement.number(0)) : std::nullopt;
}

std::optional<std::string> Database::text(std::string_view query, int& error) {
  Statement statement(connection_.get(), query);
  const int result = statement.step();
  error = result == SQLITE_ROW || result == SQLITE_DONE ? SQLITE_OK : result;
  return result == SQLITE_ROW ? std::optional(statement.text(0)) : std::nullopt;
}

// SQLITE_ERROR: the statements of the journal are correct, so the file has other tables.
bool is_unusable(int error) {
  const int primary = error & 0xFF;
  return primary == SQLITE_CORRUPT || primary == SQLITE_NOTADB || primary == SQLITE_ERROR ||
         primary == SQLITE_MISMATCH;
}

std::string error_text(int error) {
  return sqlite3_errstr(error);
}

}  // namespace linegate::gateway
