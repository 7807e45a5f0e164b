// SPDX-License-Identifier: Apache-2.0
// The authority of a plant, its identities, and the findings of their check.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "gateway/security/authority.h"
#include "gateway/security/files.h"
#include "gateway/security/fingerprint.h"
#include "gateway/security/identity_check.h"
#include "gateway/security/identity_watch.h"
#include "gateway/security/peer_certificates.h"
#include "gateway/security/revoked_names.h"

#include "tests/paths.h"

namespace linegate::security {
namespace {

namespace files = std::filesystem;

constexpr std::time_t kDay = 24 * 60 * 60;

std::string content(const files::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

mode_t mode_of(const files::path& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 ? status.st_mode & 0777U : 0;
}

bool run(const std::string& command) {
  return std::system(("(" + command + ") >/dev/null 2>&1").c_str()) == 0;
}

// As a full disk: no file becomes longer than `size` octets.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t size) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    EXPECT_EQ(::getrlimit(RLIMIT_FSIZE, &before_), 0);
    const rlimit limit{size, before_.rlim_max};
    EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

class Authority : public testing::Test {
 protected:
  Authority() { EXPECT_EQ(init(plant.string()), ""); }
  ~Authority() override { files::remove_all(top); }

  std::string issue_as(const std::string& name, Role role, bool renew = false, int days = 60) {
    return issue(plant.string(), {{.name = name, .role = role}, days, renew});
  }
  // Every file and folder below the folder, in order.
  static std::vector<std::string> entries(const files::path& folder) {
    std::vector<std::string> out;
    for (const auto& each : files::recursive_directory_iterator(folder))
      out.push_back(each.path().lexically_relative(folder).string());
    std::sort(out.begin(), out.end());
    return out;
  }
  // The findings of the identity, one per line, without the folder.
  std::string findings(const files::path& folder, std::time_t after = 0) const {
    std::string out;
    for (const Diagnostic& found : check_identity(folder.string(), std::time(nullptr) + after))
      out += files::path(found.file).filename().string() + " " + found.text + "\n";
    return out;
  }
  bool openssl_accepts(const files::path& identity) const {
    return run("openssl verify -crl_check -CAfile '" + (plant / "ca.crt").string() +
               "' -CRLfile '" + (plant / "revoked.crl").string() + "' '" +
               (identity / kCertificateFile).string() + "'");
  }
  // Replaces a text in a signed document, and signs it again if asked.
  void change(const files::path& file, const std::string& before, const std::string& after,
              bool sign) const {
    const std::string plain = (top / "plain").string();
    ASSERT_TRUE(run("openssl smime -verify -text -noverify -in '" + file.string() + "' -out '" +
                    plain + "'"));
    std::string text = content(sign ? files::path(plain) : file);
    const std::size_t at = text.find(before);
    ASSERT_NE(at, std::string::npos);
    std::ofstream(sign ? files::path(plain) : file) << text.replace(at, before.size(), after);
    if (sign) {
      ASSERT_TRUE(run("openssl smime -sign -text -in '" + plain + "' -out '" + file.string() +
                      "' -signer '" + (plant / "ca.crt").string() + "' -inkey '" +
                      (plant / "ca.key").string() + "'"));
    }
  }

  const files::path top =
      files::path(testing::TempDir()) / ("security-" + std::to_string(::getpid()));
  const files::path plant = top / "plant";
};

TEST_F(Authority, IsMadeOnce) {
  const std::string before = content(plant / "ca.key");
  EXPECT_EQ(mode_of(plant / "ca.key"), 0600U);
  EXPECT_EQ(init(plant.string()),
            (plant / "ca.crt").string() + " exists: the folder has an authority already");
  EXPECT_EQ(content(plant / "ca.key"), before);
}

TEST_F(Authority, IssuesIdentitiesThatOpensslAccepts) {
  for (const Role role : {Role::gateway, Role::viewer, Role::operator_, Role::engineer}) {
    const std::string name(security::name(role));
    ASSERT_EQ(issue_as(name, role), "");
    EXPECT_EQ(findings(plant / name), "");
    EXPECT_TRUE(openssl_accepts(plant / name));
    EXPECT_EQ(mode_of(plant / name), 0700U);
    EXPECT_EQ(mode_of(plant / name / kKeyFile), 0600U);
    ASSERT_TRUE(identity_of((plant / name).string()));
    EXPECT_EQ(identity_of((plant / name).string())->name, name);
    EXPECT_EQ(identity_of((plant / name).string())->role, role);
    for (const char* document : {kGovernanceFile, kPermissionsFile}) {
      EXPECT_TRUE(run("openssl smime -verify -text -in '" + (plant / name / document).string() +
                      "' -CAfile '" + (plant / "ca.crt").string() + "'"))
          << document;
    }
  }
  // The folder of an identity has nothing of the authority that is secret.
  EXPECT_FALSE(files::exists(plant / "viewer" / "ca.key"));
}

TEST_F(Authority, OverwritesNothingSilently) {
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  const std::string before = content(plant / "alice" / kCertificateFile);
  EXPECT_EQ(issue_as("alice", Role::engineer),
            (plant / "alice").string() +
                " exists: revoke \"alice\" before you issue it again, or use --renew");
  EXPECT_EQ(content(plant / "alice" / kCertificateFile), before);
  files::create_directory(plant / "notes");
  EXPECT_NE(issue_as("notes", Role::viewer), "");
}

// A renewal extends no right.
TEST_F(Authority, ARenewedIdentityKeepsItsRoleAndItsLines) {
  const auto issue_operator = [&](bool renew, std::vector<std::string> lines) {
    return issue(plant.string(),
                 {.holder = {.name = "alice", .role = Role::operator_, .lines = lines},
                  .renew = renew,
                  .keep_lines = renew && lines.empty()});
  };
  const auto partitions = [&] {
    std::vector<std::string> out;
    std::ifstream in(plant / "alice" / kPermissionsFile);
    for (std::string text; std::getline(in, text) && !text.starts_with("</publish>");) {
      if (text.starts_with("<partition>"))
        out.push_back(text.substr(0, text.find("</")));
    }
    return out;
  };
  EXPECT_EQ(issue_operator(true, {}), "there is no identity " + (plant / "alice").string() +
                                          " to renew: issue it without --renew");
  EXPECT_FALSE(files::exists(plant / "alice"));
  ASSERT_EQ(issue_operator(false, {"plant/press", "hall/*"}), "");
  const std::string key = content(plant / "alice" / kKeyFile);
  const std::vector<std::string> both{"<partition>plant/press/operator/alice",
                                      "<partition>hall/*/operator/alice"};
  ASSERT_EQ(partitions(), both);
  for (int i = 0; i < 2; ++i) {
    ASSERT_EQ(issue_operator(true, {}), "");
    EXPECT_EQ(partitions(), both);
  }
  EXPECT_NE(content(plant / "alice" / kKeyFile), key);
  EXPECT_EQ(issue_as("alice", Role::gateway, true),
            "\"alice\" is of role operator: revoke it before you issue it with another role");
  EXPECT_EQ(partitions(), both);
  ASSERT_EQ(issue_operator(true, {"plant/pack"}), "");
  EXPECT_EQ(partitions(), (std::vector<std::string>{"<partition>plant/pack/operator/alice"}));
}

TEST_F(Authority, RefusesNamesThatWouldBePathsOrPatterns) {
  const auto entries = [&] {
    return std::distance(files::directory_iterator(plant), files::directory_iterator());
  };
  const auto before = entries();
  for (const char* name :
       {"", ".", "..", "../x", "a/b", "*", "a b", "a,CN=b", ".hidden", "a?", "[a]"})
    EXPECT_NE(issue_as(name, Role::viewer).find("is no name of an identity"), std::string::npos)
        << name;
  EXPECT_NE(issue_as(std::string(65, 'a'), Role::viewer), "");
  EXPECT_NE(revoke(plant.string(), "../plant").find("is no name"), std::string::npos);
  for (const char* line :
       {"", "press", "plant/press/engineer", "pl*/press", "plant/pr?ss", "/press"}) {
    EXPECT_NE(issue(plant.string(), {{.name = "x", .role = Role::operator_, .lines = {line}}}), "")
        << line;
  }
  EXPECT_NE(issue_as("x", Role::viewer, false, 0), "");
  EXPECT_NE(issue_as("x", Role::viewer, false, kAuthorityDays + 1), "");
  EXPECT_EQ(entries(), before);
}

TEST_F(Authority, RevokesAndIssuesAgain) {
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  ASSERT_EQ(issue_as("bob", Role::viewer), "");
  ASSERT_EQ(revoke(plant.string(), "alice"), "");
  EXPECT_EQ(findings(plant / "alice"), "identity.crt is revoked: issue the identity again\n");
  EXPECT_FALSE(openssl_accepts(plant / "alice"));
  EXPECT_EQ(findings(plant / "bob"), "");
  EXPECT_TRUE(openssl_accepts(plant / "bob"));
  EXPECT_EQ(content(plant / "bob" / kRevocationsFile), content(plant / kRevocationsFile));
  EXPECT_EQ(revoke(plant.string(), "alice"), "\"alice\" is revoked already");
  EXPECT_EQ(
      revoke(plant.string(), "carol"),
      "no identity \"carol\" was issued here: if you have a copy of its identity.crt, revoke it "
      "with --certificate");
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  EXPECT_EQ(findings(plant / "alice"), "");
}

TEST_F(Authority, ARenewedCertificateIsRevokedWithItsIdentity) {
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  const files::path stolen = top / "stolen";
  files::copy(plant / "alice", stolen);
  ASSERT_EQ(issue_as("alice", Role::operator_, true), "");
  EXPECT_NE(content(plant / "alice" / kKeyFile), content(stolen / kKeyFile));
  EXPECT_TRUE(openssl_accepts(stolen)) << "both are valid until the hosts have the new one";
  EXPECT_TRUE(openssl_accepts(plant / "alice"));
  ASSERT_EQ(revoke(plant.string(), "alice"), "");
  EXPECT_FALSE(openssl_accepts(stolen));
  EXPECT_FALSE(openssl_accepts(plant / "alice"));
}

// An older authority kept the certificates that a renewal replaced, in a folder of another name.
TEST_F(Authority, ACertificateThatAnOlderAuthorityReplacedIsRevokedWithItsIdentity) {
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  const files::path stolen = top / "stolen";
  files::copy(plant / "alice", stolen);
  ASSERT_EQ(issue_as("bob", Role::viewer), "");
  files::rename(plant / ".issued" / "alice", top / "kept");
  files::create_directory(plant / ".replaced");
  files::rename(top / "kept", plant / ".replaced" / "alice");
  ASSERT_EQ(issue_as("alice", Role::operator_, true), "");
  files::remove_all(plant / ".issued");
  ASSERT_EQ(revoke(plant.string(), "alice"), "");
  EXPECT_FALSE(openssl_accepts(stolen));
  EXPECT_FALSE(openssl_accepts(plant / "alice"));
  EXPECT_TRUE(openssl_accepts(plant / "bob"));
}

TEST_F(Authority, AnIdentityWithoutItsSubfolderIsRevokedByItsName) {
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  ASSERT_EQ(issue_as("bob", Role::viewer), "");
  files::remove_all(plant / "alice");
  ASSERT_EQ(issue_as("alice", Role::engineer), "");
  const files::path moved = top / "moved";
  files::rename(plant / "alice", moved);
  ASSERT_EQ(revoke(plant.string(), "alice"), "");
  EXPECT_FALSE(openssl_accepts(moved));
  EXPECT_TRUE(openssl_accepts(plant / "bob"));
  EXPECT_EQ(content(plant / "bob" / kRevokedNamesFile), "engineer/alice\noperator/alice\n");
  EXPECT_FALSE(files::exists(plant / "alice"));
  EXPECT_EQ(revoke(plant.string(), "alice"), "\"alice\" is revoked already");
}

// As after the loss of the authority's disk, of which only a copy of the key from before remains.
TEST_F(Authority, AnIdentityIsRevokedByItsCertificate) {
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  ASSERT_EQ(issue_as("bob", Role::viewer), "");
  const files::path host = top / "host";
  files::rename(plant / "alice", host);
  files::remove_all(plant / ".issued");
  EXPECT_NE(revoke(plant.string(), "alice"), "");
  ASSERT_EQ(revoke_certificate(plant.string(), (host / kCertificateFile).string()), "");
  EXPECT_FALSE(openssl_accepts(host));
  EXPECT_EQ(content(plant / "bob" / kRevokedNamesFile), "operator/alice\n");
  EXPECT_EQ(revoke_certificate(plant.string(), (host / kCertificateFile).string()),
            "\"alice\" is revoked already");
}

TEST_F(Authority, OnlyACertificateOfItsOwnIsRevoked) {
  const files::path other = top / "other";
  ASSERT_EQ(init(other.string()), "");
  ASSERT_EQ(issue(other.string(), {{"alice", Role::operator_}, 60}), "");
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  const auto before = content(plant / kRevocationsFile);
  const std::string foreign = (other / "alice" / kCertificateFile).string();
  EXPECT_EQ(revoke_certificate(plant.string(), foreign),
            foreign + " was issued by another authority than " + (plant / kCaFile).string());
  const std::string ca = (plant / kCaFile).string();
  EXPECT_EQ(revoke_certificate(plant.string(), ca), ca + " is not the certificate of an identity");
  const std::string key = (plant / "alice" / kKeyFile).string();
  EXPECT_EQ(revoke_certificate(plant.string(), key), key + " is not a certificate in PEM");
  EXPECT_EQ(content(plant / kRevocationsFile), before);
  EXPECT_EQ(content(plant / kRevokedNamesFile), "");
}

TEST_F(Authority, ARunningGatewayReadsRevokedNamesAgain) {
  ASSERT_EQ(issue_as("plant", Role::gateway), "");
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  RevokedNames revoked((plant / "plant" / kRevokedNamesFile).string());
  const Instant start{std::chrono::hours(1)};
  EXPECT_FALSE(revoked.contains("operator", "alice", start));
  files::remove_all(plant / "alice");
  ASSERT_EQ(issue_as("alice", Role::engineer), "");
  ASSERT_EQ(revoke(plant.string(), "alice"), "");
  const Instant later = start + RevokedNames::kPeriod;
  EXPECT_FALSE(revoked.contains("operator", "alice", later - std::chrono::nanoseconds(1)));
  EXPECT_TRUE(revoked.contains("operator", "alice", later));
  EXPECT_TRUE(revoked.contains("engineer", "alice", later)) << "the renewed certificate, too";
  EXPECT_FALSE(revoked.contains("operator", "alic", later));
}

// The certificate that was stolen has the subject of the one that was issued again.
TEST_F(Authority, ANameIssuedAgainRemainsRevokedInARunningGateway) {
  ASSERT_EQ(issue_as("plant", Role::gateway), "");
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  ASSERT_EQ(revoke(plant.string(), "alice"), "");
  const std::string file = (plant / "plant" / kRevokedNamesFile).string();
  RevokedNames running(file);
  const Instant start{std::chrono::hours(1)};
  EXPECT_TRUE(running.contains("operator", "alice", start));
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  EXPECT_EQ(content(file), "") << "the name is permitted again";
  EXPECT_TRUE(running.contains("operator", "alice", start + RevokedNames::kPeriod));
  EXPECT_FALSE(RevokedNames(file).contains("operator", "alice", start)) << "a new process";
}

TEST_F(Authority, ANameRevokedAndIssuedAgainBetweenTwoRequestsRemainsRevoked) {
  ASSERT_EQ(issue_as("plant", Role::gateway), "");
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  RevokedNames running((plant / "plant" / kRevokedNamesFile).string());
  const Instant start{std::chrono::hours(1)};
  EXPECT_FALSE(running.contains("operator", "alice", start));
  ASSERT_EQ(revoke(plant.string(), "alice"), "");
  running.update(start + RevokedNames::kPeriod);
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  EXPECT_TRUE(running.contains("operator", "alice", start + 2 * RevokedNames::kPeriod));
}

TEST_F(Authority, ARunningGatewayKeepsItsRevokedNamesWithoutTheFile) {
  ASSERT_EQ(issue_as("plant", Role::gateway), "");
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  ASSERT_EQ(revoke(plant.string(), "alice"), "");
  const files::path file = plant / "plant" / kRevokedNamesFile;
  RevokedNames running(file.string());
  Instant now{std::chrono::hours(1)};
  ASSERT_TRUE(running.contains("operator", "alice", now));
  std::ofstream(file) << "";
  EXPECT_TRUE(running.contains("operator", "alice", now += RevokedNames::kPeriod)) << "empty";
  files::remove(file);
  EXPECT_TRUE(running.contains("operator", "alice", now += RevokedNames::kPeriod)) << "missing";
  files::create_directory(file);
  EXPECT_TRUE(running.contains("operator", "alice", now += RevokedNames::kPeriod)) << "unreadable";
  EXPECT_FALSE(running.contains("viewer", "bob", now));
}

TEST_F(Authority, EveryNameIsRevokedUntilTheFileWasRead) {
  const files::path file = top / kRevokedNamesFile;
  RevokedNames running(file.string());
  const Instant start{std::chrono::hours(1)};
  EXPECT_TRUE(running.contains("operator", "bob", start)) << "missing";
  files::create_directory(file);
  EXPECT_TRUE(running.contains("operator", "bob", start + RevokedNames::kPeriod)) << "unreadable";
  files::remove(file);
  std::ofstream(file) << "operator/alice\n";
  EXPECT_FALSE(running.contains("operator", "bob", start + 2 * RevokedNames::kPeriod));
}

TEST_F(Authority, APartOfANameIsNotRevoked) {
  const files::path file = top / kRevokedNamesFile;
  std::ofstream(file) << "operator/alice\noperator/bob";  // cp has not written "by\n" yet
  RevokedNames running(file.string());
  const Instant start{std::chrono::hours(1)};
  EXPECT_TRUE(running.contains("operator", "alice", start));
  std::ofstream(file) << "operator/alice\noperator/bobby\n";
  EXPECT_TRUE(running.contains("operator", "bobby", start + RevokedNames::kPeriod));
  EXPECT_FALSE(running.contains("operator", "bob", start + RevokedNames::kPeriod));
}

TEST_F(Authority, ARevocationThatFailedIsCompletedByTheNextOne) {
  for (const char* name : {"alice", "bob", "carol", "dave"})
    ASSERT_EQ(issue_as(name, Role::operator_), "");
  // No file can replace a folder.
  for (const char* file : {kRevocationsFile, kRevokedNamesFile}) {
    files::remove(plant / "bob" / file);
    files::create_directory(plant / "bob" / file);
  }
  const std::string failed = revoke(plant.string(), "alice");
  for (const char* file : {kRevocationsFile, kRevokedNamesFile}) {
    EXPECT_NE(failed.find((plant / "bob" / file).string() + " cannot be written"),
              std::string::npos)
        << failed;
    for (const char* name : {"alice", "carol", "dave"})
      EXPECT_EQ(content(plant / name / file), content(plant / file)) << name << " " << file;
    EXPECT_FALSE(files::exists(plant / "bob" / (std::string(file) + ".new")));
    files::remove(plant / "bob" / file);
  }
  EXPECT_EQ(revoke(plant.string(), "alice"), "\"alice\" is revoked already");
  for (const char* file : {kRevocationsFile, kRevokedNamesFile})
    EXPECT_EQ(content(plant / "bob" / file), content(plant / file)) << file;
  EXPECT_EQ(content(plant / "bob" / kRevokedNamesFile), "operator/alice\n");
}

TEST_F(Authority, TheNameIsRevokedEvenIfTheListCannotBeWritten) {
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  const std::string list = content(plant / kRevocationsFile);
  {
    const FileSizeLimit limit(list.size() / 2);
    EXPECT_NE(revoke(plant.string(), "alice").find("revoked.crl cannot be written: File too large"),
              std::string::npos);
  }
  EXPECT_EQ(content(plant / kRevocationsFile), list);
  EXPECT_EQ(content(plant / "alice" / kRevokedNamesFile), "operator/alice\n");
  EXPECT_EQ(content(plant / kRevokedNamesFile), "operator/alice\n");
  ASSERT_EQ(revoke(plant.string(), "alice"), "");
  EXPECT_EQ(findings(plant / "alice"), "identity.crt is revoked: issue the identity again\n");
}

TEST_F(Authority, AnAuthorityWithoutRevokedNamesIsNamed) {
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  files::remove(plant / kRevokedNamesFile);
  const std::string expected = (plant / kRevokedNamesFile).string() +
                               " cannot be read: copy it from the folder of an identity";
  EXPECT_EQ(revoke(plant.string(), "alice"), expected);
  EXPECT_EQ(issue_as("bob", Role::viewer), expected);
  EXPECT_FALSE(files::exists(plant / "bob"));
}

TEST_F(Authority, IssuingAgainUpdatesTheRevokedNamesOfAllIdentities) {
  ASSERT_EQ(issue_as("plant", Role::gateway), "");
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  ASSERT_EQ(revoke(plant.string(), "alice"), "");
  ASSERT_EQ(content(plant / "plant" / kRevokedNamesFile), "operator/alice\n");
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  for (const char* folder : {".", "plant", "alice"})
    EXPECT_EQ(content(plant / folder / kRevokedNamesFile), "") << folder;
}

TEST_F(Authority, ANameRemainsRevokedIfItCannotBeIssuedAgain) {
  ASSERT_EQ(issue_as("plant", Role::gateway), "");
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  ASSERT_EQ(revoke(plant.string(), "alice"), "");
  files::remove_all(plant / ".issued");
  std::ofstream(plant / ".issued") << "prevents the last step before the replacement";
  EXPECT_NE(issue_as("alice", Role::operator_), "");
  for (const char* folder : {".", "plant", "alice"})
    EXPECT_EQ(content(plant / folder / kRevokedNamesFile), "operator/alice\n") << folder;
  EXPECT_FALSE(files::exists(plant / ".alice.new"));
}

TEST_F(Authority, AnIssueThatReachedNotAllIdentitiesIsCompletedByARenewal) {
  ASSERT_EQ(issue_as("plant", Role::gateway), "");
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  ASSERT_EQ(revoke(plant.string(), "alice"), "");
  files::remove(plant / "plant" / kRevokedNamesFile);
  files::create_directory(plant / "plant" / kRevokedNamesFile);
  EXPECT_NE(issue_as("alice", Role::operator_).find("\"alice\" was issued, but "),
            std::string::npos);
  EXPECT_EQ(findings(plant / "alice"), "");
  files::remove(plant / "plant" / kRevokedNamesFile);
  ASSERT_EQ(issue_as("alice", Role::operator_, true), "");
  EXPECT_EQ(content(plant / "plant" / kRevokedNamesFile), "");
  EXPECT_TRUE(files::exists(plant / "plant" / kRevokedNamesFile));
}

TEST_F(Authority, ARenewalReplacesIdentitiesOnly) {
  const std::string key = content(plant / "ca.key");
  files::create_directory(plant / "notes");
  std::ofstream(plant / "notes" / "text") << "of a person";
  std::ofstream(plant / "list") << "of a person";
  files::create_symlink(plant / "nowhere", plant / "link");
  const auto before = entries(plant);
  for (const char* name : {kCaFile, "ca.key", kGovernanceFile, kRevocationsFile, kRevokedNamesFile,
                           "ca.key.new", "revoked.crl.new"}) {
    EXPECT_EQ(issue_as(name, Role::viewer, true),
              "\"" + std::string(name) + "\" is a file of the authority: use another name");
  }
  for (const bool renew : {false, true}) {
    for (const char* name : {"notes", "list", "link"}) {
      EXPECT_EQ(issue_as(name, Role::viewer, renew),
                (plant / name).string() +
                    " exists, and is no identity, because it has no readable identity.crt: use "
                    "another name, or move it to another place");
    }
  }
  EXPECT_EQ(entries(plant), before);
  EXPECT_EQ(content(plant / "ca.key"), key);
}

TEST_F(Authority, AFailedInitLeavesNothing) {
  const files::path made = top / "made";
  const files::path empty = top / "empty";
  files::create_directory(empty);
  {
    const FileSizeLimit limit(400);  // the key is shorter, the governance longer
    EXPECT_EQ(init(made.string()),
              (made / kGovernanceFile).string() + " cannot be written: File too large");
    EXPECT_NE(init(empty.string()), "");
  }
  EXPECT_FALSE(files::exists(made));
  EXPECT_TRUE(files::is_empty(empty));
  EXPECT_EQ(init(made.string()), "");
  EXPECT_EQ(init(empty.string()), "");
}

TEST_F(Authority, AFailedInitRemovesNoFileFromBefore) {
  const files::path folder = top / "moved";
  files::create_directory(folder);
  std::ofstream(folder / kRevokedNamesFile) << "operator/alice\n";
  EXPECT_NE(init(folder.string()).find("the folder has an authority already"), std::string::npos);
  EXPECT_EQ(content(folder / kRevokedNamesFile), "operator/alice\n");
}

TEST_F(Authority, AFailedCommandLeavesNoFileBesideTheOldOne) {
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  const auto before = entries(plant);
  {
    const FileSizeLimit limit(100);
    EXPECT_NE(revoke(plant.string(), "alice"), "");
    EXPECT_NE(issue_as("bob", Role::viewer), "");
  }
  EXPECT_EQ(entries(plant), before);
}

TEST_F(Authority, ACommandThatWasKilledLeavesNoHalfIdentity) {
  files::create_directory(plant / ".alice.new");
  std::ofstream(plant / ".alice.new" / kKeyFile) << "half";
  ASSERT_EQ(issue_as("alice", Role::viewer), "");
  EXPECT_EQ(findings(plant / "alice"), "");
  EXPECT_FALSE(files::exists(plant / ".alice.new"));
}

TEST_F(Authority, AFolderWithoutAnAuthorityIsNamed) {
  EXPECT_NE(issue(top.string(), {{.name = "x"}}).find("make an authority with"), std::string::npos);
  EXPECT_NE(init("/proc/nowhere").find("cannot be created"), std::string::npos);
}

class Check : public Authority {
 protected:
  Check() {
    EXPECT_EQ(issue_as("alice", Role::operator_), "");
    EXPECT_EQ(issue_as("bob", Role::operator_), "");
    EXPECT_EQ(init(other.string()), "");
    EXPECT_EQ(issue(other.string(), {{.name = "alice", .role = Role::operator_}, 60}), "");
  }
  void take(const char* file, const files::path& from) const {
    files::copy_file(from / file, alice / file, files::copy_options::overwrite_existing);
  }
  // Of alice, with TIME for each time in UTC.
  std::string findings_without_time(std::time_t after) const {
    static const std::regex time("[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{2}:[0-9]{2}:[0-9]{2} UTC");
    return std::regex_replace(findings(alice, after), time, "TIME");
  }
  const files::path alice = plant / "alice";
  const files::path other = top / "other";
};

TEST_F(Check, NamesMissingAndUnreadableFiles) {
  files::remove(alice / kPermissionsFile);
  files::permissions(alice / kKeyFile, files::perms::group_read, files::perm_options::add);
  EXPECT_EQ(findings(alice),
            "identity.key is a private key that other users may read: chmod 600\n"
            "permissions.smime is missing: copy the whole folder of the identity\n");
}

TEST_F(Check, AFolderOfAnotherUserIsNotMissing) {
  constexpr uid_t kNobody = 65534;
  const bool root = ::geteuid() == 0;
  files::permissions(alice, files::perms::none);  // root may enter it all the same
  if (root) {
    ASSERT_EQ(::seteuid(kNobody), 0);
  }
  const std::string found = findings(alice);
  if (root) {
    ASSERT_EQ(::seteuid(0), 0);
  }
  files::permissions(alice, files::perms::owner_all);
  EXPECT_EQ(found.find("missing"), std::string::npos) << found;
  EXPECT_EQ(found.find("ca.crt cannot be read by this user\n"), 0U) << found;
}

TEST_F(Check, NamesContentThatIsNotWhatTheFileNamePromises) {
  for (const char* file : {kCaFile, kCertificateFile})
    std::ofstream(alice / file) << "nonsense";
  EXPECT_NE(findings(alice).find("ca.crt is not a certificate in PEM\n"), std::string::npos);
  take(kCaFile, plant);
  EXPECT_NE(findings(alice).find("identity.crt is not a certificate in PEM\n"), std::string::npos);
}

TEST_F(Check, NamesAnotherAuthority) {
  take(kCaFile, other);
  const std::string found = findings(alice);
  EXPECT_NE(found.find("identity.crt was issued by another authority than ca.crt\n"),
            std::string::npos)
      << found;
  EXPECT_NE(found.find("revoked.crl was signed by another authority than ca.crt\n"),
            std::string::npos);
  EXPECT_NE(found.find("permissions.smime was changed, or signed by another authority than ca.crt"),
            std::string::npos);
}

TEST_F(Check, NamesCertificatesOutsideTheirTime) {
  EXPECT_EQ(findings_without_time(31 * kDay), "identity.crt expires within 30 days, on TIME\n");
  EXPECT_EQ(findings_without_time(61 * kDay),
            "identity.crt has expired, on TIME: issue the identity again\n"
            "permissions.smime has expired, on TIME: issue the identity again\n");
  EXPECT_EQ(findings_without_time(-kDay),
            "ca.crt is not valid yet, but from TIME: compare the clock of this host\n"
            "identity.crt is not valid yet, but from TIME: compare the clock of this host\n"
            "permissions.smime is not valid yet, but from TIME: compare the clock of this host\n");
  const std::string all = findings_without_time(3651 * kDay);
  EXPECT_EQ(all.find("ca.crt has expired, on TIME: make a new authority, and issue each identity "
                     "again\n"),
            0U)
      << all;
}

TEST_F(Check, NamesTheTimeOfACertificateAsItsIssuerDoes) {
  const std::string file = (top / "end").string();
  ASSERT_TRUE(
      run("TZ=UTC date -u '+%Y-%m-%dT%H:%M:%S UTC' -d \"$(openssl x509 -noout -enddate -in '" +
          (alice / kCertificateFile).string() + "' | cut -d= -f2)\" > '" + file + "'"));
  std::string end = content(file);
  end.erase(end.find('\n'));
  EXPECT_EQ(findings(alice, 31 * kDay), "identity.crt expires within 30 days, on " + end + "\n");
}

TEST_F(Check, NamesAFolderThatIsNoneOfAnIdentity) {
  const auto folder = [&](const files::path& at) {
    const auto found = check_identity(at.string(), std::time(nullptr));
    EXPECT_EQ(found.size(), 1U) << at;
    EXPECT_EQ(found.empty() ? "" : found[0].file, at.string());
    return found.empty() ? "" : found[0].text;
  };
  EXPECT_EQ(folder(plant / "nobody"),
            "does not exist: name the folder of an identity (linegate security issue)");
  EXPECT_EQ(folder(alice / kKeyFile / "nobody"),
            "does not exist: name the folder of an identity (linegate security issue)");
  EXPECT_EQ(folder(alice / kCertificateFile),
            "is not a folder: name the folder of an identity, with its files");
  EXPECT_EQ(folder(plant), "is the folder of an authority: name that of an identity, as " +
                               (plant / "NAME").string());
  const auto of_gateway = check_gateway(plant.string(), "hall-7", std::time(nullptr));
  ASSERT_EQ(of_gateway.size(), 1U) << "linegated and linegate check report the same";
  EXPECT_EQ(of_gateway[0].text, folder(plant));
  const files::path empty = top / "empty";
  files::create_directory(empty);
  EXPECT_NE(findings(empty).find("identity.crt is missing: copy the whole folder"),
            std::string::npos);
}

TEST_F(Check, NamesAKeyThatDoesNotFitOrHasAPassword) {
  take(kKeyFile, plant / "bob");
  EXPECT_EQ(
      findings(alice),
      "identity.key does not match identity.crt: copy the whole folder of the identity again\n");
  ASSERT_TRUE(run("openssl pkey -aes128 -passout pass:secret -in '" + (alice / kKeyFile).string() +
                  "' -out '" + (top / "locked").string() + "'"));
  files::copy_file(top / "locked", alice / kKeyFile, files::copy_options::overwrite_existing);
  files::permissions(alice / kKeyFile, files::perms::owner_read | files::perms::owner_write);
  EXPECT_EQ(findings(alice), "identity.key is not a private key in PEM, or has a password\n");
}

TEST_F(Check, NamesPermissionsOfAnotherSubject) {
  take(kPermissionsFile, plant / "bob");
  EXPECT_EQ(findings(alice),
            "permissions.smime is for another subject, \"CN=bob,OU=operator,O=linegate\": write "
            "<subject_name>CN=alice,OU=operator,O=linegate</subject_name>, as in identity.crt\n");
}

TEST_F(Check, NamesTheSubjectInAnotherOrder) {
  change(alice / kPermissionsFile, "CN=alice,OU=operator,O=linegate",
         "O=linegate, OU=operator, CN=alice", true);
  EXPECT_EQ(findings(alice),
            "permissions.smime is for the same subject in another order, "
            "\"O=linegate, OU=operator, CN=alice\": write "
            "<subject_name>CN=alice,OU=operator,O=linegate</subject_name>, as in identity.crt\n");
}

TEST_F(Check, NamesADocumentThatWasChangedOrIsNotSigned) {
  change(alice / kPermissionsFile, "*/*/operator/alice", "*/*/engineer/alice", false);
  EXPECT_EQ(findings(alice),
            "permissions.smime was changed, or signed by another authority than ca.crt\n");
  std::ofstream(alice / kPermissionsFile) << governance();
  EXPECT_EQ(findings(alice), "permissions.smime is not a signed document (S/MIME)\n");
  files::copy_file(plant / kGovernanceFile, alice / kPermissionsFile,
                   files::copy_options::overwrite_existing);
  EXPECT_EQ(findings(alice), "permissions.smime is a signed document of another kind\n");
}

TEST_F(Check, AGatewayNeedsItsOwnIdentity) {
  ASSERT_EQ(issue_as("hall-7", Role::gateway), "");
  const auto check = [&](const char* name, const char* gateway) {
    return check_gateway((plant / name).string(), gateway, std::time(nullptr));
  };
  EXPECT_TRUE(check("hall-7", "hall-7").empty());
  ASSERT_EQ(check("hall-7", "hall-8").size(), 1U);
  ASSERT_EQ(check("alice", "alice").size(), 1U);
  EXPECT_EQ(check("alice", "alice")[0].text,
            "is of operator \"alice\": a gateway needs an identity of role gateway with its own "
            "name, \"alice\"");
  EXPECT_TRUE(check_gateway("", "any", 0).empty()) << "without DDS-Security";
}

// The identity with which a gateway sends requests to lines of other gateways.
TEST_F(Check, RequestsOfAGatewayNeedARoleThatSendsAndTheirLines) {
  const auto issue_to = [&](const char* name, Role role, std::vector<std::string> lines) {
    return issue(plant.string(),
                 {.holder = {.name = name, .role = role, .lines = std::move(lines)}});
  };
  ASSERT_EQ(issue_as("hall-7", Role::gateway), "");
  ASSERT_EQ(issue_as("viewer", Role::viewer), "");
  ASSERT_EQ(issue_to("all", Role::operator_, {"*/*"}), "");
  ASSERT_EQ(issue_to("two", Role::engineer, {"hall-b/press", "hall-c/*"}), "");
  const auto check = [&](const files::path& folder, const std::vector<std::string>& lines) {
    std::string out;
    for (const Diagnostic& found :
         check_requests(folder.string(), (plant / "hall-7").string(), lines, std::time(nullptr))) {
      EXPECT_EQ(found.severity, Severity::error);
      out += found.text + "\n";
    }
    std::string alone;
    for (const Diagnostic& found : check_request_lines(folder.string(), lines))
      alone += found.text + "\n";
    EXPECT_TRUE(alone.empty() || alone == out) << "a gateway that runs has checked the rest";
    return out;
  };
  EXPECT_EQ(check(plant / "all", {"hall-b/press", "hall-c/any"}), "");
  EXPECT_EQ(check(plant / "two", {"hall-b/press", "hall-c/any"}), "");
  EXPECT_EQ(check(plant / "two", {"hall-b/press2"}),
            "does not permit requests to hall-b/press2: issue the identity again with --line "
            "hall-b/press2 and its other lines (linegate security issue --renew), copy its folder "
            "to this host, and restart the gateway\n");
  const std::string none =
      ", which sends no requests: issue an identity of role operator (to "
      "read) or engineer (to read and write)\n";
  EXPECT_EQ(check(plant / "viewer", {"hall-b/press"}), "is of role viewer" + none);
  EXPECT_EQ(check(plant / "hall-7", {"hall-b/press"}), "is of role gateway" + none);
  EXPECT_EQ(check(plant / "viewer", {}), "is of role viewer" + none) << "without routes as well";
  const files::path foreign = top / "foreign";
  ASSERT_EQ(init(foreign.string()), "");
  ASSERT_EQ(issue(foreign.string(), {.holder = {.name = "all", .role = Role::engineer}}), "");
  EXPECT_EQ(check(foreign / "all", {"hall-b/press"}),
            "was issued by another authority than the identity of the gateway, " +
                (plant / "hall-7").string() + ": the requests would reach nobody\n");
  EXPECT_FALSE(check(plant / "nobody", {}).empty());
  EXPECT_TRUE(check_requests("", "", {"hall-b/press"}, 0).empty()) << "without DDS-Security";
}

TEST_F(Check, AGatewayNeedsItsRevokedNames) {
  ASSERT_EQ(issue_as("hall-7", Role::gateway), "");
  const auto check = [&] {
    return check_gateway((plant / "hall-7").string(), "hall-7", std::time(nullptr));
  };
  files::remove(plant / "hall-7" / kRevokedNamesFile);
  ASSERT_EQ(check().size(), 1U);
  EXPECT_EQ(check()[0].text, "is missing: copy the whole folder of the identity");
  EXPECT_EQ(check()[0].file, (plant / "hall-7" / kRevokedNamesFile).string());
  EXPECT_EQ(check()[0].severity, Severity::error);
  EXPECT_EQ(findings(plant / "hall-7"),
            "revoked.names is missing: copy the whole folder of the identity\n");
  files::create_directory(plant / "hall-7" / kRevokedNamesFile);
  EXPECT_EQ(findings(plant / "hall-7"), "revoked.names cannot be read by this user\n");
  files::remove(alice / kRevokedNamesFile);
  EXPECT_EQ(findings(alice), "") << "only a gateway reads it";
}

TEST_F(Check, PermissionsOfAnEarlierVersionDoNotSufficeForNamedTopics) {
  ASSERT_EQ(issue_as("hall-7", Role::gateway), "");
  const files::path folder = plant / "hall-7";
  const NamedTopics both{{"plant/press/ram/inputs", "plant/press/ram/outputs"},
                         {"plant/press/drives/outputs/set"}};
  const auto check = [&](const NamedTopics& topics) {
    std::string out;
    for (const Diagnostic& found :
         check_gateway(folder.string(), "hall-7", std::time(nullptr), topics)) {
      EXPECT_EQ(found.severity, Severity::error);
      EXPECT_EQ(found.file, (folder / kPermissionsFile).string());
      out += found.text + "\n";
    }
    std::string alone;
    for (const Diagnostic& found : check_named_topics(folder.string(), topics))
      alone += found.text + "\n";
    EXPECT_EQ(alone, out);
    return out;
  };
  const auto refused = [](const std::string& what) {
    return "does not permit the gateway to " + what +
           ", because it was issued by an earlier version: issue the identity again (linegate "
           "security issue --renew), copy its folder to this host, and restart the gateway\n";
  };
  EXPECT_EQ(check(both), "");
  change(folder / kPermissionsFile, "<topic>plant/*/*/outputs/set</topic>", "", true);
  EXPECT_EQ(check(both), refused("subscribe the named topic plant/press/drives/outputs/set"));
  EXPECT_EQ(check({both.published, {}}), "");
  const NamedTopics others{{}, {}, {"linegate/v1/LineState", "linegate/v1/ProcessImage"}};
  EXPECT_EQ(check(others), "");
  change(folder / kPermissionsFile,
         "<subscribe><topics>\r\n<topic>linegate/v1/GatewayState</topic>\r\n"
         "<topic>linegate/v1/LineState</topic>",
         "<subscribe><topics>\r\n<topic>linegate/v1/GatewayState</topic>", true);
  EXPECT_EQ(check(others), refused("subscribe the topic of other gateways linegate/v1/LineState"));
  change(folder / kPermissionsFile, "<topic>plant/*/inputs</topic>", "", true);
  EXPECT_EQ(check(both), refused("publish the named topic plant/press/ram/inputs"));
  EXPECT_EQ(check({}), "") << "no named topics are configured";
  ASSERT_EQ(issue_as("hall-7", Role::gateway, true), "");
  EXPECT_EQ(check(both), "");
  EXPECT_TRUE(check_named_topics("", both).empty()) << "without DDS-Security";
  std::ofstream(folder / kPermissionsFile) << "being replaced";
  EXPECT_FALSE(check_named_topics(folder.string(), both).empty());
  EXPECT_TRUE(check_named_topics(folder.string(), {}).empty())
      << "a reload without named topics does not depend on the file";
}

TEST(Documents, EachTopicOfTheContractHasItsPlace) {
  const std::string idl = content(paths::in_repository("idl/linegate.idl"));
  const std::regex topic("\"(linegate/v1/[A-Za-z]+)\"");
  const std::string gateway = permissions({.name = "g", .role = Role::gateway}, "s", "a", "b");
  unsigned topics = 0;
  for (std::sregex_iterator it(idl.begin(), idl.end(), topic), end; it != end; ++it, ++topics) {
    EXPECT_NE(gateway.find("<topic>" + (*it)[1].str() + "</topic>"), std::string::npos)
        << it->str();
  }
  EXPECT_GE(topics, 12U);
}

TEST(Documents, RequestsHaveThePartitionsOfTheirWriter) {
  const auto text = [](Role role, std::vector<std::string> lines) {
    return permissions({.name = "alice", .role = role, .lines = std::move(lines)}, "s", "a", "b");
  };
  EXPECT_NE(text(Role::engineer, {"*/*"}).find("<partition>*/*/engineer/alice</partition>"),
            std::string::npos);
  const std::string two = text(Role::operator_, {"plant/press", "plant/"});
  EXPECT_NE(two.find("<partition>plant/press/operator/alice</partition>\n"
                     "<partition>plant//operator/alice</partition>"),
            std::string::npos);
  EXPECT_EQ(text(Role::viewer, {"*/*"}).find("<publish>"), std::string::npos);
}

// The ends of the names distinguish what a gateway publishes from what clients write.
TEST(Documents, NamedTopicsHaveTheRulesOfTheirWriter) {
  const auto text = [](Role role, std::vector<std::string> lines) {
    return permissions({.name = "alice", .role = role, .lines = std::move(lines)}, "s", "a", "b");
  };
  const std::string published =
      "<topic>plant/*/inputs</topic>\n<topic>plant/*/outputs</topic>\n</topics>\n";
  const auto set = [](const std::string& lines) {
    return "<topic>plant/" + lines + "/*/outputs/set</topic>\n";
  };
  const std::string gateway = text(Role::gateway, {});
  EXPECT_LT(gateway.find(published), gateway.find("<subscribe>"));
  EXPECT_NE(gateway.find(set("*") + "</topics>\n<partitions>\n<partition>alice/*</partition>"),
            std::string::npos);
  EXPECT_GT(gateway.find(set("*")), gateway.find("<subscribe>"));
  const std::string viewer = text(Role::viewer, {});
  EXPECT_GT(viewer.find(published), viewer.find("<subscribe>"));
  EXPECT_NE(viewer.find(published), std::string::npos);
  EXPECT_EQ(viewer.find("outputs/set"), std::string::npos);
  for (const Role role : {Role::operator_, Role::engineer}) {
    const std::string two = text(role, {"plant/press", "hall/pack", "plant/"});
    const std::size_t reads = two.find("<subscribe>");
    EXPECT_GT(two.find(published), reads);
    EXPECT_LT(two.find(set("press") + set("pack") + "</topics>\n<partitions>"), reads);
    EXPECT_EQ(two.find("outputs/set", reads), std::string::npos);
    EXPECT_EQ(two.find(set("*")), std::string::npos);
  }
}

// Calculated with sha256sum from the DER that openssl prints for that subject.
TEST_F(Authority, FingerprintsAreThoseOfTheCertificates) {
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  const std::string der = (top / "subject").string();
  ASSERT_TRUE(run("openssl x509 -in '" + (plant / "alice" / kCertificateFile).string() +
                  "' -outform DER -out '" + der + ".crt' && openssl asn1parse -inform DER -in '" +
                  der + ".crt' -strparse $(openssl asn1parse -inform DER -in '" + der +
                  ".crt' | awk '/SEQUENCE/ && $0 ~ /d=2/ {n++} n==4 {sub(/:.*/, \"\"); print $1; "
                  "exit}') -out '" +
                  der + "' && sha256sum '" + der + "' > '" + der + ".sum'"));
  const std::string sum = content(der + ".sum");
  Fingerprint expected{};
  unsigned above = 1;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const auto octet = static_cast<unsigned>(std::stoul(sum.substr(2 * i, 2), nullptr, 16));
    expected[i] = static_cast<std::uint8_t>(above << 7U | octet >> 1U);
    above = octet & 1U;
  }
  EXPECT_EQ(fingerprint_of("alice", Role::operator_), expected);
  EXPECT_NE(fingerprint_of("alice", Role::engineer), expected);
}

// --- identities that lose their access while a gateway runs --------------------------------------

// The certificate of an identity in PEM, as in a message of a handshake.
std::vector<std::uint8_t> pem_of(const files::path& identity) {
  const std::string text = content(identity / kCertificateFile);
  return {text.begin(), text.end()};
}

TEST_F(Authority, TheEarliestEndOfTheCertificatesOfOthersIsKnown) {
  ASSERT_EQ(issue_as("alice", Role::operator_, false, 20), "");
  ASSERT_EQ(issue_as("victor", Role::viewer, false, 10), "");
  PeerCertificates peers((plant / kCaFile).string());
  EXPECT_EQ(peers.next_expiry(), 0);
  const std::time_t now = std::time(nullptr);
  EXPECT_TRUE(peers.note(pem_of(plant / "alice"), now));
  const std::time_t of_alice = peers.next_expiry();
  EXPECT_NEAR(static_cast<double>(of_alice), static_cast<double>(now + 20 * kDay), 60.0);
  EXPECT_TRUE(peers.note(pem_of(plant / "victor"), now));
  EXPECT_NEAR(static_cast<double>(peers.next_expiry()), static_cast<double>(now + 10 * kDay), 60.0);
  // A new participant does not note what has expired: the library refuses it.
  PeerCertificates later((plant / kCaFile).string());
  EXPECT_TRUE(later.note(pem_of(plant / "alice"), of_alice));
  EXPECT_EQ(later.next_expiry(), 0);
}

TEST_F(Authority, CertificatesOfOtherAuthoritiesAreNotNoted) {
  const files::path other = top / "other";
  ASSERT_EQ(init(other.string()), "");
  ASSERT_EQ(issue(other.string(), {{.name = "alice", .role = Role::operator_}, 1}), "");
  PeerCertificates peers((plant / kCaFile).string());
  EXPECT_FALSE(peers.note(pem_of(other / "alice"), std::time(nullptr)));
  EXPECT_FALSE(peers.note({}, std::time(nullptr)));
  const std::string text = "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n";
  EXPECT_FALSE(peers.note(std::vector<std::uint8_t>(text.begin(), text.end()), 0));
  EXPECT_EQ(peers.next_expiry(), 0);
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  PeerCertificates without((top / "none").string());
  EXPECT_FALSE(without.note(pem_of(plant / "alice"), std::time(nullptr)));
}

// Forged ones cost processor time until their signature is refused.
TEST_F(Authority, TheNumberOfCertificatesThatAreVerifiedIsLimited) {
  const files::path other = top / "other";
  ASSERT_EQ(init(other.string()), "");
  ASSERT_EQ(issue(other.string(), {{.name = "eve", .role = Role::operator_}, 1}), "");
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  ASSERT_EQ(issue_as("victor", Role::viewer), "");
  PeerCertificates peers((plant / kCaFile).string());
  const std::time_t now = std::time(nullptr);
  EXPECT_TRUE(peers.note(pem_of(plant / "alice"), now));
  for (unsigned i = 0; i < PeerCertificates::kMostPerSecond; ++i)
    EXPECT_FALSE(peers.note(pem_of(other / "eve"), now));
  EXPECT_TRUE(peers.note(pem_of(plant / "alice"), now)) << "was verified before";
  EXPECT_FALSE(peers.note(pem_of(plant / "victor"), now));
  EXPECT_TRUE(peers.note(pem_of(plant / "victor"), now + 1));
}

TEST_F(Authority, AChangedListOrAnExpiredCertificateRequiresANewParticipant) {
  ASSERT_EQ(issue_as("plant", Role::gateway), "");
  ASSERT_EQ(issue_as("alice", Role::operator_), "");
  Instant now{std::chrono::hours(1)};
  IdentityWatch watch(files_in((plant / "plant").string()));
  EXPECT_EQ(watch.due(now, 1'000, 0), "");
  EXPECT_EQ(watch.due(now, 1'000, 1'000), "");
  EXPECT_EQ(watch.due(now, 1'001, 1'000), "the certificate of a participant has expired");
  ASSERT_EQ(revoke(plant.string(), "alice"), "");
  EXPECT_EQ(watch.due(now += IdentityWatch::kPeriod, 0, 0), "revoked.crl has changed");
  EXPECT_EQ(watch.due(now, 0, 0), "revoked.crl has changed") << "it was not replaced";
  watch.note_replaced(now);
  EXPECT_EQ(watch.due(now += IdentityWatch::kPeriod, 1'001, 1'000), "") << "the pause";
  EXPECT_EQ(watch.due(now += IdentityWatch::kPause, 0, 0), "");
  EXPECT_LE(IdentityWatch::kPeriod + IdentityWatch::kPause, std::chrono::seconds(30));
}

// A participant would not start with it.
TEST_F(Authority, AListThatIsIncompleteOrOfAnotherAuthorityChangesNothing) {
  ASSERT_EQ(issue_as("plant", Role::gateway), "");
  const files::path other = top / "other";
  ASSERT_EQ(init(other.string()), "");
  const files::path list = plant / "plant" / kRevocationsFile;
  const std::string whole = content(list);
  Instant now{std::chrono::hours(1)};
  IdentityWatch watch(files_in((plant / "plant").string()));
  std::ofstream(list) << whole.substr(0, whole.size() / 2);
  EXPECT_EQ(watch.due(now += IdentityWatch::kPeriod, 0, 0), "") << "a part";
  files::copy_file(other / kRevocationsFile, list, files::copy_options::overwrite_existing);
  EXPECT_EQ(watch.due(now += IdentityWatch::kPeriod, 0, 0), "") << "another authority";
  files::remove(list);
  EXPECT_EQ(watch.due(now += IdentityWatch::kPeriod, 0, 0), "") << "missing";
  std::ofstream(list) << whole;
  EXPECT_EQ(watch.due(now += IdentityWatch::kPeriod, 0, 0), "") << "the same";
}

}  // namespace
}  // namespace linegate::security
