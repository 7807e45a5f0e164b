// SPDX-License-Identifier: Apache-2.0
// Random changes of random configurations: a reload changes a line only if its own part, its
// executor, its device files or its partners in routing and forwarding have changed.
#include <algorithm>
#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "gateway/config/plan_difference.h"

#include "tests/gateway/plans.h"
#include "tests/plant/environment.h"

namespace linegate::config::random_reload {
namespace {

constexpr unsigned long kFirstSeed = 1;
constexpr unsigned long kPlants = 12;
constexpr int kChanges = 12;

struct ModelLine {
  std::string name;
  int network = 0;
  std::map<int, std::string> nodes;  // names by node-ID
  int sync = 0;                      // ms
  bool enter = false;
  std::string executor;
};

struct ModelRule {
  std::string from;
  int from_node = 0;
  std::string to;
  int to_node = 0;
  int sub = 1;
  friend auto operator<=>(const ModelRule&, const ModelRule&) = default;
};

struct Model {
  std::vector<ModelLine> lines;
  std::vector<int> routes;  // networks that are reached over the first line of the model
  std::vector<ModelRule> rules;
  int priority = 1;
};

class Changer {
 public:
  explicit Changer(unsigned seed) : random_(seed) {
    for (int i = 0; i < 3; ++i) {
      add_line();
    }
  }

  unsigned pick(std::size_t below) {
    return static_cast<unsigned>(random_() % std::max<std::size_t>(below, 1));
  }

  void change() {
    switch (pick(10)) {
      case 0:
        return add_line();
      case 1:
        return remove_line();
      case 2:
        model_.lines[pick(model_.lines.size())].nodes.begin()->second = "n" + number();
        return;
      case 3:
        model_.lines[pick(model_.lines.size())].sync = 1 + static_cast<int>(pick(5));
        return;
      case 4:
        model_.lines[pick(model_.lines.size())].enter ^= true;
        return;
      case 5:
        model_.priority = 1 + static_cast<int>(pick(3));
        return;
      case 6:
        return add_route();
      case 7:
        return add_rule();
      case 8:
        if (!model_.rules.empty()) {
          model_.rules.erase(model_.rules.begin() + pick(model_.rules.size()));
        }
        return;
      default:
        std::shuffle(model_.lines.begin() + 1, model_.lines.end(), random_);
        std::shuffle(model_.routes.begin(), model_.routes.end(), random_);
        std::shuffle(model_.rules.begin(), model_.rules.end(), random_);
        return;
    }
  }

  const Model& model() const { return model_; }

 private:
  std::string number() { return std::to_string(next_++); }

  void add_line() {
    if (model_.lines.size() >= 6) {
      return;
    }
    ModelLine line;
    line.network = next_network_++;
    line.name = "l" + std::to_string(line.network);
    for (int node = 5; node <= 5 + static_cast<int>(pick(2)); ++node) {
      line.nodes[node] = "n" + number();
    }
    line.enter = pick(3) == 0;
    line.executor = pick(4) == 0 ? "fast" : "";
    const auto place = model_.lines.empty() ? 0 : 1 + pick(model_.lines.size());
    model_.lines.insert(model_.lines.begin() + place, line);
  }

  // Never removes the first line, because the routes use it.
  void remove_line() {
    if (model_.lines.size() < 3) {
      return;
    }
    const auto gone = model_.lines.begin() + 1 + pick(model_.lines.size() - 1);
    std::erase_if(model_.rules, [&](const ModelRule& rule) {
      return rule.from == gone->name || rule.to == gone->name;
    });
    model_.lines.erase(gone);
  }

  void add_route() {
    const int network = 200 + static_cast<int>(pick(5));
    if (std::erase(model_.routes, network) == 0) {
      model_.routes.insert(model_.routes.begin() + pick(model_.routes.size() + 1), network);
    }
  }

  void add_rule() {
    const ModelLine& from = model_.lines[pick(model_.lines.size())];
    const ModelLine& to = model_.lines[pick(model_.lines.size())];
    const ModelRule rule{from.name, from.nodes.begin()->first, to.name, to.nodes.begin()->first,
                         1 + static_cast<int>(pick(2))};
    const bool taken = std::ranges::any_of(model_.rules, [&](const ModelRule& other) {
      return other.to == rule.to && other.sub == rule.sub;
    });
    if (from.name != to.name && !taken) {
      model_.rules.push_back(rule);
    }
  }

  std::mt19937 random_;
  Model model_;
  int next_ = 1;
  int next_network_ = 1;
};

const ModelLine& line_of(const Model& model, const std::string& name) {
  return *std::ranges::find(model.lines, name, &ModelLine::name);
}

std::string part_of(const ModelLine& line) {
  std::string out = "  - {name: " + line.name + ", interface: 'virtual:" + line.name +
                    "', network_id: " + std::to_string(line.network) + ", nodes: [";
  for (const auto& [id, name] : line.nodes) {
    out += "{id: " + std::to_string(id) + ", name: " + name +
           ", eds: bridges/sim/eds/digital-io.eds}, ";
  }
  out += "]";
  out += line.sync == 0 ? "" : ", sync: " + std::to_string(line.sync) + "ms";
  out += line.enter ? ", enter: all" : "";
  out += line.executor.empty() ? "" : ", executor: " + line.executor;
  return out + "}\n";
}

std::string text_of(const Model& model) {
  std::string out =
      "schema: 1\nexecutors: [{name: fast, priority: " + std::to_string(model.priority) +
      "}]\nlines:\n";
  for (const ModelLine& line : model.lines) {
    out += part_of(line);
  }
  out += model.routes.empty() ? "" : "routes:\n";
  for (const int network : model.routes) {
    out += "  - {to: " + std::to_string(network) + ", via: '" + model.lines.front().name + ":9'}\n";
  }
  out += model.rules.empty() ? "" : "forward:\n";
  for (const ModelRule& rule : model.rules) {
    out += "  - " + rule.from + '.' + line_of(model, rule.from).nodes.at(rule.from_node) +
           ".6000:" + std::to_string(rule.sub) + " -> " + rule.to + '.' +
           line_of(model, rule.to).nodes.at(rule.to_node) + ".6200:" + std::to_string(rule.sub) +
           '\n';
  }
  return out;
}

// All lines that are connected to this one by rules, directly or indirectly.
std::set<std::string> cluster_of(const Model& model, const std::string& name) {
  std::set<std::string> out{name};
  for (std::size_t before = 0; before != out.size();) {
    before = out.size();
    for (const ModelRule& rule : model.rules) {
      if (out.contains(rule.from) || out.contains(rule.to)) {
        out.insert({rule.from, rule.to});
      }
    }
  }
  return out;
}

// Everything in the configuration that may affect this line.
std::string seen_by(const Model& model, const std::string& name) {
  const bool routes = !model.routes.empty() || std::ranges::any_of(model.lines, &ModelLine::enter);
  std::string out = part_of(line_of(model, name)) + (routes ? "routes" : "");
  const std::set<std::string> cluster = cluster_of(model, name);
  std::set<ModelRule> rules;  // rules of its partners as well: they change the partners
  for (const ModelRule& rule : model.rules) {
    if (cluster.contains(rule.from)) {
      rules.insert(rule);
    }
  }
  for (const ModelRule& rule : rules) {
    out += '|' + rule.from + std::to_string(rule.from_node) + rule.to +
           std::to_string(rule.to_node) + std::to_string(rule.sub);
  }
  // Lines that are connected by rules share an executor.
  for (const std::string& other : cluster) {
    out += '+' + other + line_of(model, other).executor;
  }
  const auto fast = std::ranges::any_of(
      cluster, [&](const std::string& other) { return line_of(model, other).executor == "fast"; });
  return out + (fast ? std::to_string(model.priority) : "");
}

// Compares what the running line was created from, except names and routes.
void expect_same(const LinePlan& before, const LinePlan& after) {
  EXPECT_EQ(before.executor, after.executor);
  EXPECT_EQ(before.config.bound, after.config.bound);
  EXPECT_EQ(before.config.routing.interface, after.config.routing.interface);
  EXPECT_EQ(before.config.routing.access.size(), after.config.routing.access.size());
  ASSERT_EQ(before.config.nodes.size(), after.config.nodes.size());
  for (std::size_t i = 0; i < before.config.nodes.size(); ++i) {
    EXPECT_EQ(before.config.nodes[i].id, after.config.nodes[i].id);
    EXPECT_EQ(before.config.nodes[i].name, after.config.nodes[i].name);
  }
  EXPECT_EQ(before.config.sync_period, after.config.sync_period);
}

const LinePlan& plan_of(const Plant& plant, const std::string& name) {
  return *std::ranges::find_if(plant.lines,
                               [&](const LinePlan& plan) { return plan.config.name == name; });
}

void check_reload(const Model& was, const Plant& running, const Model& is, const Plant& wanted) {
  const PlanDifference found = difference(identity_of(running), wanted);
  for (const ModelLine& line : is.lines) {
    const bool there = std::ranges::find(was.lines, line.name, &ModelLine::name) != was.lines.end();
    const bool unchanged = std::ranges::find(found.unchanged, line.name) != found.unchanged.end();
    if (there && seen_by(was, line.name) == seen_by(is, line.name)) {
      EXPECT_TRUE(unchanged) << line.name << " is disturbed\n" << text_of(was) << text_of(is);
    }
    if (unchanged) {
      const LinePlan& before = plan_of(running, line.name);
      const LinePlan& after = plan_of(wanted, line.name);
      expect_same(before, after);
      const bool rerouted = std::ranges::find(found.rerouted, line.name) != found.rerouted.end();
      EXPECT_EQ(rerouted, before.routes != after.routes);
    }
  }
}

// LINEGATE_PLANT_SEED and LINEGATE_PLANT_COUNT select other seeds, as for the random plants.
TEST(RandomReload, ALineThatNothingConcernsStaysAsItIs) {
  const auto [first, count] = plant::seeds_of_run(kFirstSeed, kPlants);
  std::size_t unchanged = 0;
  for (unsigned long seed = first; seed < first + count; ++seed) {
    SCOPED_TRACE(seed);
    Changer changer(static_cast<unsigned>(seed));
    Model was = changer.model();
    Plant running = gateway::make_plant(text_of(was));
    for (int change = 0; change < kChanges; ++change) {
      changer.change();
      const Model is = changer.model();
      Plant wanted = gateway::make_plant(text_of(is));
      ASSERT_FALSE(wanted.lines.empty()) << text_of(is);
      check_reload(was, running, is, wanted);
      unchanged += difference(identity_of(running), wanted).unchanged.size();
      was = is;
      running = std::move(wanted);
      if (testing::Test::HasFailure()) {
        return;
      }
    }
  }
  EXPECT_GT(unchanged, count * kChanges) << "most lines are unchanged";
}

}  // namespace
}  // namespace linegate::config::random_reload
