// SPDX-License-Identifier: Apache-2.0
// The lines of a plant while `bind:` and `forward:` are resolved. Internal to this folder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gateway/config/sections.h"
#include "stack/image/layout.h"
#include "stack/line/line.h"

namespace linegate::config {

class JoinedLines {
 public:
  // An entry: number in the layout of its line and direction.
  struct End {
    std::size_t line = 0;
    std::uint32_t entry = 0;
    Place place;
  };

  JoinedLines(Findings& findings, std::vector<LineSection>& lines, std::vector<Binding>& bindings)
      : findings_(findings), lines_(lines), bindings_(bindings), made_(lines.size()) {}

  std::size_t size() const { return lines_.size(); }
  LineSection& line(std::size_t line) { return lines_[line]; }
  const std::string& name(std::size_t line) const { return lines_[line].plan.config.name; }
  const image::Entry& entry(const End& end, image::Direction direction);
  const std::vector<image::Entry>& entries(std::size_t line, image::Direction direction);
  // As EntryNames::find() for one entry. With a place, an ambiguous text is reported there.
  std::optional<std::uint32_t> find_entry(std::size_t line, image::Direction direction,
                                          const std::string& text,
                                          std::optional<Place> place = std::nullopt);
  // "; did you mean ...?", or empty.
  std::string suggestion(std::size_t line, image::Direction direction, const std::string& text);
  // Reports an unknown name at `place`.
  std::optional<std::size_t> find_line(const std::string& name, Place place);

  // Whether nothing else writes the output: no other input that it follows, and no group. Otherwise
  // reports an error at its place.
  bool is_free(const End& output);
  // Makes the output follow the input. Returns nullptr, after an error at `place` (of the end that
  // was named last), if that is not possible.
  Binding* join(const End& input, const End& output, Place place);

  // Adds a binding with an end that is not an image entry.
  void add(Binding binding) { bindings_.push_back(std::move(binding)); }
  std::size_t last_binding() const { return bindings_.size() - 1; }
  Binding& binding(std::size_t number) { return bindings_[number]; }

  // Call it after all forwarding rules are joined: objects that lines have by then belong to
  // `own_pdos` and are not available to free_object().
  void reserve_objects();
  // An unused object from B000h on for a value of that type, in the line and in the lines that
  // forwarding joins it with; nothing if there is none.
  std::optional<od::Address> free_object(od::DataType type, std::uint32_t bits, std::size_t line);

  // Call it last: orders LineConfig::bound. A binding is part of the source of both lines. Lines
  // joined by forwarding share an executor unless they name different ones.
  void finish();

 private:
  const line::Line& made(std::size_t line);
  std::size_t line_called(const std::string& name) const;
  std::vector<std::size_t> clusters(bool forwarding_alone) const;
  void add_to_sources();
  void share_executors();

  Findings& findings_;
  std::vector<LineSection>& lines_;
  std::vector<Binding>& bindings_;
  std::vector<std::unique_ptr<line::Line>> made_;
  std::set<od::Address> reserved_;
  std::vector<std::size_t> clusters_;  // of forwarding
};

}  // namespace linegate::config
