// QoS comes from a file, and a bad file is told by its name.
#include "bridges/dds/profiles.h"

#include <gtest/gtest.h>

#include "bridges/dds/publisher.h"

#include "tests/dds/fixtures.h"

namespace linegate::test {
namespace {

// What a gateway process with that file says before it ends.
std::string complaint(const std::string& path) {
  Peer gateway("gateway", path);
  return gateway.expect(path);
}

TEST(Profiles, AMissingFileIsNamed) {
  const std::string said = complaint("/nonexistent/profiles.xml");
  EXPECT_EQ(said, "/nonexistent/profiles.xml: error: cannot read the file of DDS profiles");
}

TEST(Profiles, AFileThatIsNotXmlIsNamedWithTheReason) {
  const File file("<dds><profiles>");
  const std::string said = complaint(file.path);
  EXPECT_NE(said.find("not a usable file of DDS profiles: "), std::string::npos) << said;
  EXPECT_EQ(said.find("no reason given"), std::string::npos) << said;
}

TEST(Profiles, AMissingProfileIsNamed) {
  std::string text(dds::built_in_profiles());
  const std::string name = "<data_writer profile_name=\"linegate/v1/Event\">";
  ASSERT_NE(text.find(name), std::string::npos);
  text.replace(text.find(name), name.size(), "<data_writer profile_name=\"other\">");
  const File file(text);
  const std::string said = complaint(file.path);
  EXPECT_NE(said.find("there is no data_writer profile \"linegate/v1/Event\""), std::string::npos)
      << said;
}

TEST(Profiles, ContradictoryLimitsAreNamed) {
  std::string text(dds::built_in_profiles());
  const std::string limit = "<max_samples>256000</max_samples>";
  ASSERT_NE(text.find(limit), std::string::npos);
  text.replace(text.find(limit), limit.size(), "<max_samples>5</max_samples>");
  const File file(text);
  const std::string said = complaint(file.path);
  EXPECT_NE(said.find("data_writer profile \"linegate/v1/Event\" is contradictory"),
            std::string::npos)
      << said;
}

TEST(Profiles, ABadDomainIsTold) {
  auto made = dds::GatewayBridge::make({"g", 1, 233, LOOPBACK_PROFILES, {}});
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.diagnostics.at(0).text.find("domain 233 is above 232"), std::string::npos);
}

TEST(Profiles, AnotherFileInTheSameProcessIsRefused) {
  ASSERT_NE(make_client(client_options()), nullptr);
  auto made = dds::GatewayBridge::make({"g", 1, domain(), "/another.xml", {}});
  ASSERT_FALSE(made.ok());
  EXPECT_EQ(made.diagnostics.at(0).file, "/another.xml");
}

}  // namespace
}  // namespace linegate::test
