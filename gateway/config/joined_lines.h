// SPDX-License-Identifier: Apache-2.0
// The lines of a plant while what joins them is read: `bind:` and `forward:`. Internal to this
// folder.
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
  // An entry, by its number in the layout of its line and direction.
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
  // As EntryNames::find() for one entry. With a place: a text that is ambiguous is an error there.
  std::optional<std::uint32_t> find_entry(std::size_t line, image::Direction direction,
                                          const std::string& text,
                                          std::optional<Place> place = std::nullopt);
  // "; did you mean ...?", or nothing.
  std::string suggestion(std::size_t line, image::Direction direction, const std::string& text);
  // A name that is none is told.
  std::optional<std::size_t> find_line(const std::string& name, Place place);

  // The output follows the input from now on. nullptr if it cannot, which is told; place: of that
  // end which was named last.
  Binding* join(const End& input, const End& output, Place place);

  // The same for what is no entry of an image.
  void add(Binding binding) { bindings_.push_back(std::move(binding)); }
  std::size_t last_binding() const { return bindings_.size() - 1; }
  Binding& binding(std::size_t number) { return bindings_[number]; }

  // When all forwarding rules are joined: objects that lines have by now are those of `own_pdos`,
  // and free for none.
  void reserve_objects();
  // An object B000h.. for a value of that type that neither the line nor one that forwarding joins
  // it with has yet; nothing if there is none.
  std::optional<od::Address> free_object(od::DataType type, std::uint32_t bits, std::size_t line);

  // When all is joined: puts LineConfig::bound in order. What follows what is a part of the source
  // of both lines; those joined by forwarding share an executor unless they name others.
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
