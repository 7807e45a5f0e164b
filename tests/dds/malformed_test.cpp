// SPDX-License-Identifier: Apache-2.0
// Malformed samples of unknown clients are rejected with the reason and do no harm.
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/profiles.h"

#include "tests/dds/fixtures.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

class Malformed : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_FALSE(gateway.expect("ready").empty());
    requests = endpoints.writer<v1::CommandRequestPubSubType>(v1::TOPIC_COMMAND_REQUEST);
    replies = endpoints.reader<v1::CommandReplyPubSubType>(v1::TOPIC_COMMAND_REPLY);
    outputs = endpoints.writer<v1::OutputWritePubSubType>(v1::TOPIC_OUTPUT_WRITE);
    ASSERT_TRUE(endpoints.ok());
  }

  static v1::CommandRequest request(std::uint64_t id) {
    v1::CommandRequest sample;
    sample.gateway(known::kGateway);
    sample.line(known::kLine);
    sample.client("stranger");
    sample.id(id);
    sample.kind(v1::COMMAND_SDO_READ);
    sample.node(9);
    sample.sub(1);
    sample.last(true);
    return sample;
  }

  static v1::OutputWrite output() {
    v1::OutputWrite sample;
    sample.gateway(known::kGateway);
    sample.line(known::kLine);
    sample.client("stranger");
    sample.values().resize(1);
    sample.values()[0].data({1});
    return sample;
  }

  // Sends the request until it is answered, and returns the reply.
  v1::CommandReply ask(v1::CommandRequest sample) {
    v1::CommandReply reply;
    EXPECT_TRUE(eventually([&] {
      requests->write(&sample);
      replies->wait_for_unread_message({0, 100'000'000});
      eprosima::fastdds::dds::SampleInfo info;
      while (replies->take_next_sample(&reply, &info) == ReturnCode_t::RETCODE_OK) {
        if (info.valid_data && reply.id() == sample.id())
          return true;
      }
      return false;
    }));
    return reply;
  }

  // Sends the sample until the gateway rejects an output, and returns the line that it prints.
  std::string refused(v1::OutputWrite sample) {
    std::string line;
    eventually([&] {
      outputs->write(&sample);
      line = gateway.expect("output-refused", std::chrono::milliseconds(100));
      return !line.empty();
    });
    return line;
  }

  Peer gateway{"gateway"};
  std::vector<Diagnostic> diagnostics;
  dds::Endpoints endpoints{"stranger", domain(), paths::kLoopbackProfiles, diagnostics};
  eprosima::fastdds::dds::DataWriter* requests = nullptr;
  eprosima::fastdds::dds::DataReader* replies = nullptr;
  eprosima::fastdds::dds::DataWriter* outputs = nullptr;
};

TEST_F(Malformed, CommandsAreRefusedWithTheReasonAndTheNextIsCarriedOut) {
  const auto refusal = [&](std::uint64_t id, auto spoil) {
    v1::CommandRequest sample = request(id);
    spoil(sample);
    const v1::CommandReply reply = ask(sample);
    EXPECT_EQ(reply.domain(), v1::RESULT_REFUSED);
    EXPECT_TRUE(reply.last());
    EXPECT_NE(reply.text().size(), 0U);
    return reply.code();
  };
  EXPECT_EQ(refusal(1, [](auto& s) { s.kind(200); }), v1::REFUSAL_BAD_REQUEST);
  EXPECT_EQ(refusal(2, [](auto& s) { s.node(200); }), v1::REFUSAL_BAD_REQUEST);
  EXPECT_EQ(refusal(3, [](auto& s) { s.offset(8'192); }), v1::REFUSAL_BAD_REQUEST);
  EXPECT_EQ(refusal(4, [](auto& s) { s.data().resize(8'193); }), v1::REFUSAL_BAD_REQUEST);
  EXPECT_EQ(refusal(5, [](auto& s) { s.line("nowhere"); }), v1::REFUSAL_UNKNOWN_LINE);
  EXPECT_EQ(refusal(6, [](auto& s) { s.incarnation(1); }), v1::REFUSAL_WRONG_INCARNATION);
  EXPECT_FALSE(gateway.expect("command-refused line=line1 client=stranger kind=200").empty());
  const v1::CommandReply good = ask(request(7));
  EXPECT_EQ(good.domain(), v1::RESULT_DONE);
  EXPECT_EQ(good.data().size(), 1'024U);
}

TEST_F(Malformed, ASampleLargerThanItsTypeIsDroppedAndTheNextIsCarriedOut) {
  EXPECT_EQ(ask(request(1)).domain(), v1::RESULT_DONE);
  v1::CommandRequest large = request(2);
  large.data().resize(500'000);
  requests->write(&large);
  EXPECT_EQ(ask(request(3)).domain(), v1::RESULT_DONE);
  // An accepted sample would have caused this line.
  EXPECT_EQ(gateway.expect("command-refused", std::chrono::milliseconds(0)), "");
}

using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;

// A type that serializes a sample incorrectly.
template <class Spoil>
struct Spoilt : v1::CommandRequestPubSubType {
  bool serialize(void* data, Payload* payload) override {
    const bool done = v1::CommandRequestPubSubType::serialize(data, payload);
    Spoil::spoil(*payload);
    return done;
  }
};
struct NeitherTrueNorFalse {
  static void spoil(Payload& payload) { payload.data[payload.length - 8] = 2; }
};
struct MoreOctetsThanThereAre {
  static void spoil(Payload& payload) { payload.data[payload.length - 4] = 0xFF; }
};
struct UnknownEncapsulation {
  static void spoil(Payload& payload) { payload.data[1] = 0x77; }
};
struct EncapsulationAlone {
  static void spoil(Payload& payload) { payload.length = 4; }
};

template <class Spoil>
class Unreadable : public Malformed {};
using Spoilers = testing::Types<NeitherTrueNorFalse, MoreOctetsThanThereAre, UnknownEncapsulation,
                                EncapsulationAlone>;
TYPED_TEST_SUITE(Unreadable, Spoilers);

TYPED_TEST(Unreadable, SamplesAreDroppedAndTheNextIsCarriedOut) {
  EXPECT_EQ(this->ask(this->request(1)).domain(), v1::RESULT_DONE);
  dds::Endpoints other{"spoiler", domain(), paths::kLoopbackProfiles, this->diagnostics};
  auto* writer = other.writer<Spoilt<TypeParam>>(v1::TOPIC_COMMAND_REQUEST);
  ASSERT_NE(writer, nullptr);
  EXPECT_TRUE(eventually([&] {
    eprosima::fastdds::dds::PublicationMatchedStatus status;
    writer->get_publication_matched_status(status);
    return status.current_count > 0;
  }));
  v1::CommandRequest sample = this->request(2);
  // More samples than the gateway keeps for one client.
  for (std::uint64_t id = 2; id < 302; ++id) {
    sample.id(id);
    EXPECT_TRUE(writer->write(&sample));
  }
  EXPECT_FALSE(this->gateway.expect("unreadable 300").empty());
  EXPECT_EQ(this->ask(this->request(1'000)).domain(), v1::RESULT_DONE);
}

TEST_F(Malformed, OutputsAreRefusedWithTheReasonAndTheNextIsTaken) {
  const auto refused_when = [&](auto spoil, const char* words) {
    v1::OutputWrite sample = output();
    spoil(sample);
    // The gateway may still report repetitions of the sample before.
    return eventually([&] { return refused(sample).find(words) != std::string::npos; });
  };
  EXPECT_TRUE(refused_when([](auto& s) { s.reactions(0xFF); }, "bits that mean nothing"));
  EXPECT_TRUE(refused_when([](auto& s) { s.values()[0].data().resize(50); }, "1 to 32 bytes"));
  EXPECT_TRUE(refused_when([](auto& s) { s.incarnation(3); }, "another start"));
  v1::OutputWrite good = output();
  EXPECT_TRUE(eventually([&] {
    outputs->write(&good);
    return !gateway.expect("output line=line1 client=stranger", std::chrono::milliseconds(100))
                .empty();
  }));
}

TEST_F(Malformed, SamplesForAnotherGatewayAreNotOurs) {
  v1::OutputWrite other = output();
  other.gateway("another");
  other.reactions(0xFF);
  outputs->write(&other);
  v1::OutputWrite bad = output();
  bad.group(17);
  bad.reactions(0xFF);
  EXPECT_NE(refused(bad).find("group=17"), std::string::npos);
}

TEST_F(Malformed, AWriterWhoseQualityOfServiceDoesNotFitIsTold) {
  namespace fast = eprosima::fastdds::dds;
  auto* factory = fast::DomainParticipantFactory::get_instance();
  auto* participant = factory->create_participant_with_profile(domain(), dds::kParticipantProfile);
  ASSERT_NE(participant, nullptr);
  fast::TypeSupport type(new v1::OutputWritePubSubType());
  type.register_type(participant);
  auto* topic = participant->create_topic(v1::TOPIC_OUTPUT_WRITE, type.get_type_name(),
                                          fast::TOPIC_QOS_DEFAULT);
  auto* publisher = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
  fast::DataWriterQos qos;
  publisher->get_datawriter_qos_from_profile(v1::TOPIC_OUTPUT_WRITE, qos);
  qos.ownership().kind = fast::SHARED_OWNERSHIP_QOS;
  ASSERT_NE(publisher->create_datawriter(topic, qos), nullptr);
  EXPECT_EQ(gateway.expect("misfit"), "misfit linegate/v1/OutputWrite ownership");
  participant->delete_contained_entities();
  factory->delete_participant(participant);
}

TEST_F(Malformed, ADisposeDoesNotSpoilWhatFollows) {
  v1::OutputWrite good = output();
  const auto arrives = [&](std::uint64_t arming) {
    good.arming(arming);
    const std::string line =
        "output line=line1 client=stranger group=0 layout=0 arming=" + std::to_string(arming) + " ";
    return eventually([&] {
      outputs->write(&good);
      return !gateway.expect(line, std::chrono::milliseconds(100)).empty();
    });
  };
  EXPECT_TRUE(arrives(1));
  EXPECT_EQ(outputs->dispose(&good, eprosima::fastdds::dds::HANDLE_NIL), ReturnCode_t::RETCODE_OK);
  EXPECT_TRUE(arrives(2));
  v1::CommandRequest command = request(1);
  EXPECT_EQ(ask(command).domain(), v1::RESULT_DONE);
  EXPECT_EQ(requests->dispose(&command, eprosima::fastdds::dds::HANDLE_NIL),
            ReturnCode_t::RETCODE_OK);
  EXPECT_EQ(ask(request(2)).domain(), v1::RESULT_DONE);
}

}  // namespace
}  // namespace linegate::test
