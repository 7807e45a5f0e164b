// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/document.h"

#include <algorithm>
#include <sstream>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include <yaml-cpp/eventhandler.h>

namespace linegate::config {
namespace {

constexpr std::string_view kMergeKey = "<<";

// Counts the values of a document with all aliases expanded, in one pass and without expanding
// them.
class ValueCounter : public YAML::EventHandler {
 public:
  explicit ValueCounter(Findings& findings) : findings_(findings) {}

  bool good() const { return good_; }
  bool merges() const { return merges_; }

  void OnDocumentStart(const YAML::Mark& /*mark*/) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override { leaf(mark, anchor); }
  void OnScalar(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t anchor,
                const std::string& value) override {
    merges_ = merges_ || value == kMergeKey;
    leaf(mark, anchor);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto known = sizes_.find(anchor);
    if (known == sizes_.end()) {
      fail(mark, "an alias stands for something that it is a part of");
      return;
    }
    add(mark, known->second);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value /*style*/) override {
    begin(mark, anchor);
  }
  void OnSequenceEnd() override { end(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value /*style*/) override {
    begin(mark, anchor);
  }
  void OnMapEnd() override { end(); }

 private:
  struct Open {
    YAML::anchor_t anchor;
    std::size_t before;  // values of the document before it
  };

  void add(const YAML::Mark& mark, std::size_t values) {
    values_ += std::min(values, kMostValues + 1);
    if (values_ > kMostValues) {
      fail(mark, "the document has more than " + std::to_string(kMostValues) +
                     " values, including those of aliases");
      values_ = 0;
    }
  }
  void leaf(const YAML::Mark& mark, YAML::anchor_t anchor) {
    add(mark, 1);
    if (anchor != 0) {
      sizes_[anchor] = 1;
    }
  }
  void begin(const YAML::Mark& mark, YAML::anchor_t anchor) {
    open_.push_back({anchor, values_});
    add(mark, 1);
  }
  void end() {
    const Open closed = open_.back();
    open_.pop_back();
    if (closed.anchor != 0) {
      sizes_[closed.anchor] = values_ - std::min(values_, closed.before);
    }
  }
  void fail(const YAML::Mark& mark, std::string text) {
    if (good_) {
      findings_.error(place_of(mark), std::move(text));
    }
    good_ = false;
  }

  Findings& findings_;
  bool good_ = true;
  bool merges_ = false;  // the document may have merge keys
  std::size_t values_ = 0;
  std::vector<Open> open_;
  std::unordered_map<YAML::anchor_t, std::size_t> sizes_;
};

// Reports the position of the second document.
class Second : public YAML::EventHandler {
 public:
  explicit Second(Findings& findings) : findings_(findings) {}

  void OnDocumentStart(const YAML::Mark& mark) override {
    findings_.error(place_of(mark),
                    "a second YAML document begins here; all of the configuration "
                    "is in one");
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& /*mark*/, YAML::anchor_t /*anchor*/) override {}
  void OnAlias(const YAML::Mark& /*mark*/, YAML::anchor_t /*anchor*/) override {}
  void OnScalar(const YAML::Mark& /*mark*/, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                const std::string& /*value*/) override {}
  void OnSequenceStart(const YAML::Mark& /*mark*/, const std::string& /*tag*/,
                       YAML::anchor_t /*anchor*/, YAML::EmitterStyle::value /*style*/) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark& /*mark*/, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                  YAML::EmitterStyle::value /*style*/) override {}
  void OnMapEnd() override {}

 private:
  Findings& findings_;
};

// Expands merge keys (yaml.org/type/merge). A value of the mapping itself takes precedence over
// merged ones, an earlier merged mapping over a later one. Keys keep their positions. The cost is
// that of a walk with all aliases expanded.
class Merging {
 public:
  explicit Merging(Findings& findings) : findings_(findings) {}

  void walk(const YAML::Node& node) {
    for (const auto& child : node) {
      walk(node.IsMap() ? child.second : YAML::Node(child));
    }
    if (node.IsMap()) {
      merge(node);
    }
  }

 private:
  void merge(YAML::Node node) {
    const YAML::Node from = std::as_const(node)[std::string(kMergeKey)];
    if (!from.IsDefined()) {
      return;
    }
    node.remove(std::string(kMergeKey));
    std::unordered_set<std::string> keys;
    for (const auto& child : node) {
      keys.insert(child.first.IsScalar() ? child.first.Scalar() : std::string());
    }
    if (from.IsMap()) {
      add(node, from, keys);
      return;
    }
    const bool list = from.IsSequence() && std::all_of(from.begin(), from.end(),
                                                       [](const auto& one) { return one.IsMap(); });
    if (!list) {
      findings_.error(place_of(from),
                      "the merge key << takes a mapping, as *name, or a list of mappings");
      return;
    }
    for (const auto& one : from) {
      add(node, one, keys);
    }
  }

  static void add(YAML::Node& node, const YAML::Node& from, std::unordered_set<std::string>& keys) {
    for (const auto& child : from) {
      if (child.first.IsScalar() && keys.insert(child.first.Scalar()).second) {
        node.force_insert(child.first, child.second);
      }
    }
  }

  Findings& findings_;
};

}  // namespace

YAML::Node load_document(Findings& findings, const std::string& text) {
  std::istringstream in(text);
  YAML::Parser parser(in);
  ValueCounter counter(findings);
  parser.HandleNextDocument(counter);
  Second second(findings);
  if (parser.HandleNextDocument(second) || !counter.good()) {
    return {};
  }
  YAML::Node root = YAML::Load(text);
  if (counter.merges()) {
    Merging(findings).walk(root);
  }
  return root;
}

}  // namespace linegate::config
