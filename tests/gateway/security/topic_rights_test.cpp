// SPDX-License-Identifier: Apache-2.0
// Which identity reads and writes which topic: each cell of the table in deploy/SECURITY.md, with
// participants that do not check their own permissions (unchecked_permissions.cpp).
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>
#include <unistd.h>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/security.h"
#include "gateway/security/authority.h"
#include "gateway/security/files.h"
#include "gateway/security/openssl.h"
#include "gateway/security/peer_certificates.h"

#include "tests/dds/own_domain.h"
#include "tests/gateway/plans.h"
#include "tests/gateway/security/rights_table.h"
#include "tests/paths.h"

namespace linegate::security {
namespace {

namespace fast = eprosima::fastdds::dds;
namespace folders = std::filesystem;
using Clock = std::chrono::steady_clock;

// Whether the gateways check certificates as the DDS process does
// (gateway/publish/dds_process.cpp).
constexpr std::chrono::seconds kLife{10};  // of the certificate that expires
// Fast DDS 2.9.1 does not authenticate every participant that joins late: new ones are made.
constexpr int kAttempts = 8;
constexpr std::chrono::seconds kOneAttempt{12};
constexpr std::chrono::seconds kAfterwards{2};  // for samples that must not arrive
constexpr std::chrono::milliseconds kPause{20};

// The rows of a topic with partitions: `own` is the partition of the identity, `other` that of
// another one.
std::string row_of(const std::string& topic, const std::string& whose = "") {
  const std::string name = topic.substr(topic.rfind('/') + 1);
  return whose.empty() ? name : name + ", " + whose;
}

// Permissions do not name types: one stands for those of all named topics.
struct NamedType : v1::OutputWritePubSubType {
  NamedType() { setName("plant::any"); }
};

// Where a member writes and reads requests and replies, as itself and as another one.
struct Partitions {
  std::string request, request_read, reply_read, reply;
};

struct Sent {
  std::string row, from, to;
  auto operator<=>(const Sent&) const = default;
};

using Reported = std::set<Sent>;

// One participant with a writer and a reader for each row.
class Member {
 public:
  Member(std::string name, const dds::Security& security, const Partitions& own,
         const Partitions& other)
      : name_(std::move(name)),
        endpoints_(name_, test::own_domain(), paths::kLoopbackProfiles, diagnostics_, true, 0,
                   security) {
    add<v1::GatewayStatePubSubType>(v1::TOPIC_GATEWAY_STATE);
    add<v1::LineStatePubSubType>(v1::TOPIC_LINE_STATE);
    add<v1::NodeStatePubSubType>(v1::TOPIC_NODE_STATE);
    add<v1::OutputStatePubSubType>(v1::TOPIC_OUTPUT_STATE);
    add<v1::ImageLayoutPubSubType>(v1::TOPIC_IMAGE_LAYOUT);
    const Pair image = add<v1::ProcessImagePubSubType>(v1::TOPIC_PROCESS_IMAGE);
    add_named("plant/press/ram/inputs", "plant/LINE/DEVICE/inputs", image);
    add_named("plant/press/ram/outputs", "plant/LINE/DEVICE/outputs", image);
    add<v1::PdoUpdatePubSubType>(v1::TOPIC_PDO_UPDATE);
    add<v1::PdoReceptionPubSubType>(v1::TOPIC_PDO_RECEPTION);
    add<v1::EventPubSubType>(v1::TOPIC_EVENT);
    for (const auto& [whose, in] : {std::pair("own", own), std::pair("other", other)}) {
      const Pair outputs = add_in<v1::OutputWritePubSubType>(v1::TOPIC_OUTPUT_WRITE, whose,
                                                             in.request, in.request_read);
      add_named("plant/press/drives/outputs/set",
                "plant/LINE/GROUP/outputs/set, " + std::string(whose), outputs);
      if (std::string_view(whose) == "own")
        add_named("plant/pack/drives/outputs/set", "plant/LINE/GROUP/outputs/set, of another line",
                  outputs);
      add_in<v1::CommandRequestPubSubType>(v1::TOPIC_COMMAND_REQUEST, whose, in.request,
                                           in.request_read);
      add_in<v1::CommandReplyPubSubType>(v1::TOPIC_COMMAND_REPLY, whose, in.reply, in.reply_read);
    }
    for (const Diagnostic& diagnostic : diagnostics_)
      ADD_FAILURE() << name_ << ": " << to_string(diagnostic);
  }

  const std::set<std::string>& rows() const { return rows_; }
  // Writes a sample to each row, and reports those that have arrived.
  void serve(Reported& out) const {
    for (const auto& write : writes_)
      write();
    for (const auto& read : reads_)
      read(out);
  }

 private:
  // The name of the writer is in each sample, so that each has instances of its own.
  template <class PubSubType>
  void add_writer(fast::DataWriter* writer, const std::string& row) {
    rows_.insert(row);
    if (writer == nullptr)
      return;
    writes_.emplace_back([writer, key = name_ + ":" + row] {
      typename PubSubType::type sample;
      sample.gateway(key);
      writer->write(&sample);
    });
  }
  template <class PubSubType>
  void add_reader(fast::DataReader* reader, const std::string& row) {
    if (reader == nullptr)
      return;
    reads_.emplace_back([reader, row, name = name_](Reported& out) {
      typename PubSubType::type sample;
      eprosima::fastdds::dds::SampleInfo info;
      while (reader->take_next_sample(&sample, &info) == ReturnCode_t::RETCODE_OK) {
        if (!info.valid_data)
          continue;
        const std::string key = sample.gateway().to_string();
        const std::size_t colon = key.find(':');
        out.insert({key.substr(colon + 1), key.substr(0, colon), name + ":" + row});
      }
    });
  }
  struct Pair {
    fast::DataWriter* writer;
    fast::DataReader* reader;
  };
  template <class PubSubType>
  Pair add_pair(Pair pair, const std::string& row) {
    add_writer<PubSubType>(pair.writer, row);
    add_reader<PubSubType>(pair.reader, row);
    return pair;
  }
  template <class PubSubType>
  Pair add(const std::string& topic) {
    return add_pair<PubSubType>(
        {endpoints_.writer<PubSubType>(topic), endpoints_.reader<PubSubType>(topic)},
        row_of(topic));
  }
  template <class PubSubType>
  Pair add_in(const std::string& topic, const std::string& whose, const std::string& write,
              const std::string& read) {
    return add_pair<PubSubType>({endpoints_.writer_in<PubSubType>(write, topic),
                                 endpoints_.reader_in<PubSubType>(read, topic)},
                                row_of(topic, whose));
  }
  // In the partitions and with the QoS of the endpoints `beside`.
  void add_named(const std::string& topic, const std::string& row, const Pair& beside) {
    ASSERT_NE(beside.writer, nullptr);
    ASSERT_NE(beside.reader, nullptr);
    fast::Topic*& made = named_topics_[topic];
    if (made == nullptr)
      made = endpoints_.add_own_topic(topic, named_type_);
    auto* const publisher = const_cast<fast::Publisher*>(beside.writer->get_publisher());
    auto* const subscriber = const_cast<fast::Subscriber*>(beside.reader->get_subscriber());
    const Pair pair{publisher->create_datawriter(made, beside.writer->get_qos()),
                    subscriber->create_datareader(made, beside.reader->get_qos())};
    ASSERT_NE(pair.writer, nullptr) << row;
    ASSERT_NE(pair.reader, nullptr) << row;
    add_pair<NamedType>(pair, row);
  }

  using ReturnCode_t = eprosima::fastrtps::types::ReturnCode_t;

  const std::string name_;
  std::vector<Diagnostic> diagnostics_;
  dds::Endpoints endpoints_;
  const fast::TypeSupport named_type_{new NamedType};
  std::map<std::string, fast::Topic*> named_topics_;
  std::set<std::string> rows_;
  std::vector<std::function<void()>> writes_;
  std::vector<std::function<void(Reported&)>> reads_;
};

Partitions of_client(const std::string& gateway, const std::string& right) {
  const std::string request = gateway + "/press/" + right;
  return {request, request, "*/*/" + right, gateway + "//" + right};
}

class TopicRights : public testing::Test {
 protected:
  TopicRights() {
    EXPECT_EQ(init(plant.string()), "");
    EXPECT_EQ(init(rogue.string()), "");
    issue_in(plant, "plant", Role::gateway);
    issue_in(plant, "hall", Role::gateway);
    issue_in(plant, "victor", Role::viewer);
    issue_in(plant, "olga", Role::operator_, {"plant/press"});
    for (const char* name : {"roger", "edgar"})
      issue_in(plant, name, Role::operator_);
    issue_in(plant, "erin", Role::engineer, {"hall/press"});
    issue_in(rogue, "olga", Role::operator_);
    folders::copy(plant / "roger", revoked);  // still has the list without its own certificate
    EXPECT_EQ(revoke(plant.string(), "roger"), "");
  }
  ~TopicRights() override { folders::remove_all(top); }

  static void issue_in(const folders::path& authority, const std::string& name, Role role,
                       std::vector<std::string> lines = {"*/*"}) {
    EXPECT_EQ(issue(authority.string(), {{name, role, std::move(lines)}, 60}), "");
  }
  // Replaces the certificate by one that ends soon. Returns its end.
  std::time_t shorten_life_of(const std::string& name) const {
    const std::string file = (plant / name / kCertificateFile).string();
    const Certificate certificate = read_certificate(file);
    const Key key = read_key((plant / "ca.key").string());
    std::time_t last = std::time(nullptr) + kLife.count();
    ASN1_TIME_set(X509_getm_notAfter(certificate.get()), last);
    EXPECT_NE(X509_sign(certificate.get(), key.get(), EVP_sha256()), 0);
    const Bio out(BIO_new_file(file.c_str(), "w"));
    EXPECT_EQ(PEM_write_bio_X509(out.get(), certificate.get()), 1);
    return last;
  }

  void join(const std::string& column, const folders::path& identity, const Partitions& own,
            const Partitions& other) {
    dds::Security security =
        identity.empty() ? dds::Security{} : dds::security_with(files_in(identity.string()));
    if (gateway::place_of_dds().process == "own" && (column == "plant" || column == "gateway")) {
      const auto peers = std::make_shared<PeerCertificates>(security.ca);
      security.accepts_certificate = [peers](std::span<const std::uint8_t> pem) {
        return peers->note(pem, std::time(nullptr));
      };
    }
    members_[column] = std::make_unique<Member>(column, security, own, other);
  }
  // Identities that no participant of the plant may accept.
  void join_strangers() {
    const std::time_t last = shorten_life_of("edgar");
    const Partitions other = of_client("plant", "engineer/erin");
    join("expired", plant / "edgar", of_client("plant", "operator/edgar"), other);
    ASSERT_LT(std::time(nullptr), last) << "this machine is too slow";
    join("revoked", revoked, of_client("plant", "operator/roger"), other);
    join("rogue authority", rogue / "olga", of_client("plant", "operator/olga"), other);
    join("none", {}, of_client("plant", "operator/olga"), other);
    while (std::time(nullptr) <= last)
      serve();
  }
  void join_members() {
    for (const std::string& column : kMembers)
      members_.erase(column);
    const Partitions olga = of_client("plant", "operator/olga");
    const Partitions erin = of_client("hall", "engineer/erin");  // sends to the other gateway
    join("plant", plant / "plant",
         {"plant/press/gateway/plant", "plant/*", "plant/*", "plant//engineer/erin"},
         {"hall/press/operator/olga", "hall/*", "*/*/operator/olga", "hall//operator/olga"});
    join("gateway", plant / "hall",
         {"hall/press/gateway/hall", "hall/*", "hall/*", "hall//operator/olga"},
         {"plant/press/operator/olga", "plant/*", "*/*/operator/olga", "plant//operator/olga"});
    join("viewer", plant / "victor", of_client("plant", "viewer/victor"), olga);
    join("operator", plant / "olga", olga, of_client("plant", "engineer/erin"));
    join("engineer", plant / "erin", erin, olga);
  }

  void serve() {
    for (const auto& [column, member] : members_)
      member->serve(reported_);
    std::this_thread::sleep_for(kPause);
  }
  bool serve_until(const std::function<bool()>& done, std::chrono::seconds limit) {
    const auto end = Clock::now() + limit;
    while (!done()) {
      if (Clock::now() > end)
        return false;
      serve();
    }
    return true;
  }

  // "write" if a member of the plant received a sample, "read" if the identity received one of a
  // member.
  Table observed(const Table& document) const {
    Table out;
    for (const std::string& row : members_.at("plant")->rows()) {
      for (const auto& [column, cell] : document.begin()->second)
        out[row][column] = cell_of(row, column);
    }
    return out;
  }
  std::string cell_of(const std::string& row, const std::string& column) const {
    bool reads = false;
    bool writes = false;
    for (const Sent& sent : reported_) {
      const std::string to = sent.to.substr(0, sent.to.find(':'));
      if (to == sent.from)
        continue;
      reads = reads || (sent.to == column + ":" + row && kMembers.contains(sent.from));
      writes = writes || (sent.from == column && sent.row == row && kMembers.contains(to));
    }
    if (reads && writes)
      return "read, write";
    return reads ? "read" : writes ? "write" : "no";
  }

  static inline const std::set<std::string> kMembers{"plant", "gateway", "viewer", "operator",
                                                     "engineer"};
  const folders::path top =
      folders::path(testing::TempDir()) / ("topic-rights-" + std::to_string(::getpid()));
  const folders::path plant = top / "plant";
  const folders::path rogue = top / "rogue";
  const folders::path revoked = top / "revoked";
  std::map<std::string, std::unique_ptr<Member>> members_;
  Reported reported_;
};

TEST_F(TopicRights, AreThoseOfTheTable) {
  const Table document = table_below("### Topics and identities");
  ASSERT_NO_FATAL_FAILURE(join_strangers());
  const auto complete = [&] {
    return std::ranges::all_of(document, [&](const auto& row) {
      return std::ranges::all_of(row.second, [&](const auto& cell) {
        return cell.second == "no" || cell_of(row.first, cell.first) == cell.second;
      });
    });
  };
  for (int attempt = 0; attempt < kAttempts && !complete(); ++attempt) {
    join_members();
    serve_until(complete, kOneAttempt);
  }
  serve_until([] { return false; }, kAfterwards);
  expect_same(document, observed(document));
}

}  // namespace
}  // namespace linegate::security
