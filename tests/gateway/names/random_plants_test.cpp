// SPDX-License-Identifier: Apache-2.0
// Random plants: each value arrives right by its name, in the client library and in the named
// types, in both directions. README.md has the way of the values.
#include <bit>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>

#include "bridges/dds/image_samples.h"
#include "bridges/dds/layout_assembly.h"
#include "bridges/named/device_types.h"
#include "bridges/named/group_types.h"
#include "bridges/named/idl_text.h"
#include "bridges/named/sample_plan.h"
#include "bridges/named/set_plan.h"

#include "tests/bridges/client/fake_link.h"
#include "tests/gateway/names/idl_reader.h"
#include "tests/gateway/names/meaning.h"
#include "tests/gateway/names/plant_bus.h"
#include "tests/gateway/names/random_device.h"

namespace linegate::names {
namespace {

using image::Direction;

constexpr std::uint64_t kFirstSeed = 1;
constexpr std::uint64_t kRuns = 60;
constexpr int kRounds = 4;  // of values
constexpr std::uint64_t kIncarnation = 7;

std::uint64_t from_environment(const char* name, std::uint64_t otherwise) {
  const char* const text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 0);
}

// The rule of bridges/named/README.md, for names without reserved words.
std::string identifier_of(const std::string& name) {
  std::string out;
  for (const char c : name) {
    const bool keep = std::isalnum(static_cast<unsigned char>(c)) != 0 && c > 0;
    if (keep)
      out += c;
    else if (!out.empty() && out.back() != '_')
      out += '_';
  }
  return std::isdigit(static_cast<unsigned char>(out[0])) != 0 ? "n" + out : out;
}

std::string meaning_of(const client::Data& data) {
  struct Text {
    std::string operator()(std::monostate) const { return "nothing"; }
    std::string operator()(bool value) const { return value ? "true" : "false"; }
    std::string operator()(std::int64_t value) const { return std::to_string(value); }
    std::string operator()(std::uint64_t value) const { return std::to_string(value); }
    std::string operator()(double value) const { return text_of(value); }
    std::string operator()(const std::string& value) const { return "'" + value; }
    std::string operator()(const std::vector<std::byte>& value) const {
      std::vector<std::uint8_t> octets;
      for (const std::byte one : value)
        octets.push_back(std::to_integer<std::uint8_t>(one));
      return hex(octets);
    }
  };
  return std::visit(Text{}, data);
}

// An application may set a number in any type that has it; here the one in which it is read.
client::Data data_of(const Mapped& mapped, const std::string& text) {
  const od::DataType type = mapped.object.type;
  if (type == od::DataType::boolean)
    return text == "true";
  if (cia_type(type).number == Number::real)
    return text == "nan" ? std::numeric_limits<double>::quiet_NaN()
                         : std::bit_cast<double>(std::uint64_t{std::stoull(text, nullptr, 16)});
  if (text[0] == '\'')
    return text.substr(1);
  if (text[0] == 'x') {
    std::vector<std::byte> octets;
    for (std::size_t i = 1; i < text.size(); i += 2)
      octets.push_back(static_cast<std::byte>(std::stoul(text.substr(i, 2), nullptr, 16)));
    return octets;
  }
  if (text[0] == '-')
    return std::int64_t{std::stoll(text)};
  return std::uint64_t{std::stoull(text)};
}

// To DDS and back, by the generated code of the contract.
template <class PubSubType>
typename PubSubType::type over_the_wire(typename PubSubType::type sample) {
  PubSubType type;
  eprosima::fastrtps::rtps::SerializedPayload_t payload(type.getSerializedSizeProvider(&sample)());
  EXPECT_TRUE(type.serialize(&sample, &payload));
  typename PubSubType::type out;
  EXPECT_TRUE(type.deserialize(&payload, &out));
  return out;
}

// A value that has to be seen.
struct Wanted {
  std::string node;
  const RandomPdo* pdo = nullptr;
  const Mapped* mapped = nullptr;
  std::string object;  // its name, unique on its node
  std::uint64_t raw = 0;

  std::string name() const { return node + '.' + object; }
  std::string member_of_group() const { return node + '_' + identifier_of(object); }
  std::string text() const { return meaning(mapped->object.type, mapped->value_bits(), raw); }
};

class RandomPlant {
 public:
  explicit RandomPlant(std::uint64_t seed) : random_(seed) {
    std::uint32_t identifier = 0x190;
    for (auto count = pick(random_, 1, 3); count > 0; --count)
      devices_.push_back(random_device(random_, identifier));
    bus_ = std::make_unique<PlantBus>(devices_);
    EXPECT_EQ(bus_->error(), "");
  }

  void run() {
    if (!bus_->error().empty())
      return;
    connect();
    for (int round = 0; round < kRounds; ++round) {
      check_inputs();
      check_outputs(round % 2 == 0);
    }
  }

 private:
  // Random values of all PDOs of a direction.
  std::vector<Wanted> random_values(Direction direction) {
    std::vector<Wanted> out;
    for (std::size_t i = 0; i < devices_.size(); ++i) {
      const bool is_input = direction == Direction::inputs;
      std::map<std::uint16_t, int> seen;  // PDOs with the object
      for (const RandomPdo& pdo : is_input ? devices_[i].inputs : devices_[i].outputs) {
        for (const Mapped& one : pdo.mapped) {
          std::string object = one.object.name;
          if (++seen[one.object.index] > 1)
            object += " in PDO " + std::to_string(pdo.number);
          out.push_back({"n" + std::to_string(i + 1), &pdo, &one, object,
                         one.random_value(random_, !is_input)});
        }
      }
    }
    return out;
  }

  // The data of its frame, as long as what it maps.
  static std::vector<std::byte> octets_of(const RandomPdo& pdo, std::uint64_t bits) {
    std::vector<std::byte> out((pdo.bits() + 7) / 8);
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = static_cast<std::byte>(bits >> 8 * i);
    return out;
  }

  // The bits of the PDO with these values.
  static std::uint64_t frame_of(const RandomPdo& pdo, const std::vector<Wanted>& values) {
    std::uint64_t data = 0;
    for (const Wanted& one : values)
      data |= one.pdo == &pdo ? one.raw << one.mapped->offset : 0;
    return data;
  }

  void check_inputs() {
    const std::vector<Wanted> values = random_values(Direction::inputs);
    for (const RandomDevice& device : devices_) {
      for (const RandomPdo& pdo : device.inputs) {
        std::uint64_t frame = frame_of(pdo, values);
        for (const Mapped& one : pdo.mapped) {  // bits above a BOOLEAN in an octet mean nothing
          if (one.bits != one.value_bits() && pick(random_, 0, 1) == 0)
            frame |= std::uint64_t{0xFE} << one.offset;
        }
        bus_->send(pdo.identifier, octets_of(pdo, frame));
      }
    }
    bus_->pass(std::chrono::milliseconds(5));
    check_values(Direction::inputs, values);
  }

  // By the client library, else by name.
  void check_outputs(bool by_client) {
    const std::vector<Wanted> values = random_values(Direction::outputs);
    by_client ? write_by_client(values) : write_by_name(values);
    bus_->pass(std::chrono::milliseconds(50));
    for (const RandomDevice& device : devices_) {
      for (const RandomPdo& pdo : device.outputs) {
        EXPECT_EQ(bus_->last_frame(pdo.identifier), octets_of(pdo, frame_of(pdo, values)))
            << "RPDO " << pdo.number << " with identifier " << pdo.identifier;
      }
    }
    check_values(Direction::outputs, values);
  }

  void write_by_client(const std::vector<Wanted>& values) {
    for (const Wanted& one : values) {
      EXPECT_EQ(client_group_.set(one.name(), data_of(*one.mapped, one.text())),
                client::Error::none)
          << one.name() << ' ' << one.text();
    }
    EXPECT_EQ(client_group_.arm(), client::Error::none);
    client_.poll(Duration{});
    if (values.empty())
      return;
    ASSERT_FALSE(world_->writes.empty());
    EXPECT_EQ(bus_->line().write_outputs(world_->writes.back().second, bus_->now()),
              line::OutputRefusal::none);
  }

  void write_by_name(const std::vector<Wanted>& values) {
    if (values.empty())
      return;
    named::Group all{"all", 0, {}};
    const image::Layout& layout = bus_->line().layout(Direction::outputs);
    for (std::uint32_t i = 0; i < layout.entries.size(); ++i)
      all.entries.push_back(i);
    const auto made = named::group_types("press", layout, std::span(&all, 1));
    ASSERT_EQ(made.types.size(), 1U) << testing::PrintToString(made.collisions);
    std::map<std::string, std::string> members{
        {"gateway", "'gw"}, {"line", "'press"}, {"client", "'test"}, {"arming", "1"}};
    for (const Wanted& one : values) {
      members["given." + one.member_of_group()] = "true";
      members["values." + one.member_of_group()] = one.text();
    }
    const IdlReader idl(named::idl_text({}, made.types));
    named::SetSample sample;
    ASSERT_TRUE(named::SetPlan(made.types[0]).read(idl.write(made.types[0].name, members), sample));
    EXPECT_EQ(sample.why, "");
    EXPECT_EQ(sample.write.values.size(), values.size());
    EXPECT_EQ(bus_->line().write_outputs(sample.write, bus_->now()), line::OutputRefusal::none);
  }

  void check_values(Direction direction, const std::vector<Wanted>& values) {
    const image::Snapshot snapshot = bus_->snapshot(direction);
    publish(snapshot);
    check_client(direction, values);
    check_named(bus_->line().layout(direction), snapshot, values);
  }

  void check_client(Direction direction, const std::vector<Wanted>& values) {
    std::vector<std::string> names;
    for (const Wanted& one : values)
      names.push_back((direction == Direction::inputs ? "inputs:" : "outputs:") + one.name());
    const client::Snapshot read = client_line_.read(names);
    for (std::size_t i = 0; i < values.size(); ++i) {
      EXPECT_EQ(meaning_of(read[i].data), values[i].text()) << names[i];
      EXPECT_EQ(read[i].quality, client::Quality::good) << names[i];
    }
  }

  static void check_named(const image::Layout& layout, const image::Snapshot& snapshot,
                          const std::vector<Wanted>& values) {
    EXPECT_EQ(layout.entries.size(), values.size());
    const named::DeviceTypes made = named::device_types("press", layout);
    EXPECT_TRUE(made.collisions.empty());
    const IdlReader idl(named::idl_text(made.types));
    std::map<std::string, std::map<std::string, std::string>> samples;  // by device
    for (const named::DeviceType& type : made.types) {
      const named::SamplePlan plan(type, "gw");
      std::vector<std::byte> sample(plan.max_size());
      const std::vector<std::int64_t> times(type.pdos.size(), 5);
      sample.resize(plan.write({1, 2, 3, 4, times}, snapshot, sample));
      samples[type.device] = idl.read(type.name, sample);
      EXPECT_EQ(samples[type.device]["line"], "'press")
          << "the sample has not the length of its type";
    }
    for (const Wanted& one : values) {
      auto& sample = samples[one.node];
      const std::string member = identifier_of(one.object);
      EXPECT_EQ(sample["values." + member], one.text()) << one.name();
      EXPECT_EQ(sample["valid." + member], "true") << one.name();
    }
  }

  // A client that receives the samples of the line.
  void connect() {
    client_line_ = client_.line("press");
    client_group_ = client_line_.group("", {});
    world_->line(kIncarnation);
    for (const Direction direction : {Direction::inputs, Direction::outputs}) {
      const image::Layout& layout = bus_->line().layout(direction);
      dds::LayoutAssembly assembly;
      image::Layout received;
      bool complete = false;
      for (std::uint16_t part = 0; part < dds::layout_parts(layout); ++part) {
        v1::ImageLayout sample;
        dds::to_wire(layout, part, sample);
        sample.incarnation(kIncarnation);
        complete = assembly.take(over_the_wire<v1::ImageLayoutPubSubType>(sample), received);
      }
      EXPECT_TRUE(complete);
      world_->samples.emplace_back(
          [received](dds::ClientListener& to) { to.on_layout(source(), received); });
      publish(bus_->snapshot(direction));
    }
    world_->group(kIncarnation, {});
    client_.poll(Duration{});
  }

  void publish(const image::Snapshot& snapshot) {
    v1::ProcessImage sample;
    EXPECT_TRUE(dds::to_wire(snapshot, {}, sample));
    image::Snapshot received;
    EXPECT_TRUE(dds::from_wire(over_the_wire<v1::ProcessImagePubSubType>(sample), {}, received));
    world_->samples.emplace_back(
        [received](dds::ClientListener& to) { to.on_image(source(), received); });
    client_.poll(Duration{});
  }

  static dds::Source source() {
    return {.gateway = "gw", .line = "press", .incarnation = kIncarnation};
  }

  Random random_;
  std::vector<RandomDevice> devices_;
  std::unique_ptr<PlantBus> bus_;
  std::shared_ptr<client::FakeWorld> world_ = std::make_shared<client::FakeWorld>();
  client::Client client_ = client::fake_client(world_);
  client::Line client_line_;
  client::Group client_group_;
};

TEST(RandomPlants, EachValueArrivesRightByItsName) {
  const std::uint64_t first = from_environment("LINEGATE_SEED", kFirstSeed);
  const std::uint64_t runs = from_environment("LINEGATE_RUNS", kRuns);
  for (std::uint64_t seed = first; seed < first + runs && !HasFailure(); ++seed) {
    SCOPED_TRACE("LINEGATE_SEED=" + std::to_string(seed) + " LINEGATE_RUNS=1");
    RandomPlant(seed).run();
  }
}

}  // namespace
}  // namespace linegate::names
