// SPDX-License-Identifier: Apache-2.0
#include "gateway/security/identity_check.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <set>
#include <sstream>
#include <utility>

#include <fnmatch.h>
#include <sys/stat.h>

#include "gateway/security/files.h"
#include "gateway/security/openssl.h"

namespace linegate::security {
namespace {

constexpr std::time_t kSoon = 30L * 24 * 60 * 60;
constexpr const char* kCompareClock = ": compare the clock of this host";
constexpr const char* kIssueAgain = "issue the identity again";

class Check {
 public:
  Check(const std::string& folder, std::time_t now, const NamedTopics& topics = {})
      : folder_(folder), now_(now), topics_(topics) {}

  std::vector<Diagnostic> take() {
    run();
    return std::move(found_);
  }

  void run() {
    check_folder();
    if (has_errors(found_))
      return;
    for (const char* file :
         {kCaFile, kCertificateFile, kKeyFile, kGovernanceFile, kPermissionsFile, kRevocationsFile})
      check_file(file);
    if (has_errors(found_))
      return;
    check_certificates();
    check_key();
    const auto identity = identity_of(folder_);
    if (certificate_ && !identity)
      report(kCertificateFile,
             "names no role: its subject needs OU=gateway, viewer, operator or engineer, and a CN");
    if (identity && identity->role == Role::gateway)
      check_file(kRevokedNamesFile);
    if (ca_ && certificate_) {
      check_revocations();
      document(kGovernanceFile, "<domain_access_rules>");
      check_permissions();
    }
  }

  std::vector<Diagnostic> run_requests(const std::string& of_gateway,
                                       const std::vector<std::string>& lines) {
    run();
    if (has_errors(found_))
      return std::move(found_);
    const Certificate other =
        read_certificate((std::filesystem::path(of_gateway) / kCaFile).string());
    if (other && X509_verify(certificate_.get(), X509_get0_pubkey(other.get())) != 1)
      report(kCertificateFile,
             "was issued by another authority than the identity of the gateway, " + of_gateway +
                 ": the requests would reach nobody");
    check_lines(lines);
    return std::move(found_);
  }

  std::vector<Diagnostic> run_lines(const std::vector<std::string>& lines) {
    ca_ = read_certificate(path(kCaFile));
    if (ca_ && open_file(path(kPermissionsFile)))
      check_lines(lines);
    return std::move(found_);
  }

  std::vector<Diagnostic> run_topics() {
    ca_ = read_certificate(path(kCaFile));
    if (ca_ && open_file(path(kPermissionsFile)))
      check_topics(document(kPermissionsFile, "<permissions>"));
    return std::move(found_);
  }

 private:
  std::string path(const char* file) const {
    return (std::filesystem::path(folder_) / file).string();
  }
  void report(const char* file, std::string text, Severity severity = Severity::error) {
    found_.push_back({severity, path(file), 0, 0, std::move(text)});
  }

  void report_folder(std::string text) {
    found_.push_back({Severity::error, folder_, 0, 0, std::move(text)});
  }

  // A folder that this user may not enter is reported by its files.
  void check_folder() {
    struct stat status {};
    const auto exists = [&](const std::string& at) { return ::stat(at.c_str(), &status) == 0; };
    if (!exists(folder_)) {
      if (errno != EACCES)
        report_folder("does not exist: name the folder of an identity (linegate security issue)");
    } else if (!S_ISDIR(status.st_mode)) {
      report_folder("is not a folder: name the folder of an identity, with its files");
    } else if (exists(path(kCaKeyFile)) && !exists(path(kCertificateFile))) {
      report_folder("is the folder of an authority: name that of an identity, as " + path("NAME"));
    }
  }

  void check_file(const char* file) {
    struct stat status {};
    const bool found = ::stat(path(file).c_str(), &status) == 0;
    // EACCES: the file is in a folder of another user.
    if (!found && errno != EACCES) {
      report(file, "is missing: copy the whole folder of the identity");
    } else if (!found || !S_ISREG(status.st_mode) || !open_file(path(file))) {
      report(file, "cannot be read by this user");
    } else if (file == kKeyFile && (status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
      report(file, "is a private key that other users may read: chmod 600");
    }
  }

  // remedy: for a certificate that has expired.
  void check_validity(const char* file, const X509& it, const std::string& remedy) {
    std::time_t now = now_;
    std::time_t soon = now_ + kSoon;
    const ASN1_TIME* const begin = X509_get0_notBefore(&it);
    const ASN1_TIME* const end = X509_get0_notAfter(&it);
    if (X509_cmp_time(begin, &now) > 0) {
      report(file, "is not valid yet, but from " + utc_text(*begin) + kCompareClock);
    } else if (X509_cmp_time(end, &now) < 0) {
      report(file, "has expired, on " + utc_text(*end) + ": " + remedy);
    } else if (X509_cmp_time(end, &soon) < 0) {
      report(file, "expires within 30 days, on " + utc_text(*end), Severity::warning);
    }
  }

  static std::string utc_text(const ASN1_TIME& time) {
    std::tm parts{};
    ASN1_TIME_to_tm(&time, &parts);
    return xml_time(parts) + " UTC";
  }

  void check_certificates() {
    ca_ = read_certificate(path(kCaFile));
    certificate_ = read_certificate(path(kCertificateFile));
    if (!ca_)
      return report(kCaFile, "is not a certificate in PEM");
    if (!certificate_)
      return report(kCertificateFile, "is not a certificate in PEM");
    check_validity(kCaFile, *ca_, "make a new authority, and issue each identity again");
    check_validity(kCertificateFile, *certificate_, kIssueAgain);
    if (X509_verify(certificate_.get(), X509_get0_pubkey(ca_.get())) != 1)
      report(kCertificateFile, "was issued by another authority than " + std::string(kCaFile));
  }

  void check_key() {
    const Key key = read_key(path(kKeyFile));
    if (!key) {
      report(kKeyFile, "is not a private key in PEM, or has a password");
    } else if (certificate_ && X509_check_private_key(certificate_.get(), key.get()) != 1) {
      report(kKeyFile, "does not match " + std::string(kCertificateFile) +
                           ": copy the whole folder of the identity again");
    }
  }

  void check_revocations() {
    const RevocationList list = read_revocations(path(kRevocationsFile));
    std::time_t now = now_;
    X509_REVOKED* entry = nullptr;
    if (!list)
      return report(kRevocationsFile, "is not a revocation list in PEM");
    if (X509_CRL_verify(list.get(), X509_get0_pubkey(ca_.get())) != 1)
      return report(kRevocationsFile,
                    "was signed by another authority than " + std::string(kCaFile));
    if (X509_cmp_time(X509_CRL_get0_nextUpdate(list.get()), &now) < 0)
      report(kRevocationsFile, "has expired: copy a new one from the authority");
    if (X509_CRL_get0_by_cert(list.get(), &entry, certificate_.get()) == 1)
      report(kCertificateFile, "is revoked: issue the identity again");
  }

  // Returns the text of a signed document, empty after an error. root: an element that it has.
  std::string document(const char* file, std::string_view root) {
    const Bio in = open_file(path(file));
    BIO* content = nullptr;
    const Pkcs7 signature(SMIME_read_PKCS7(in.get(), &content));
    const Bio owned(content);
    if (!signature || !content) {
      report(file, "is not a signed document (S/MIME)");
      return {};
    }
    const std::unique_ptr<STACK_OF(X509), void (*)(STACK_OF(X509)*)> signers(
        sk_X509_new_null(), [](STACK_OF(X509) * it) { sk_X509_free(it); });
    sk_X509_push(signers.get(), ca_.get());
    const Bio out(BIO_new(BIO_s_mem()));
    // Only the certificate of the authority counts, not those in the document.
    constexpr int kFlags = PKCS7_TEXT | PKCS7_NOVERIFY | PKCS7_NOINTERN;
    if (PKCS7_verify(signature.get(), signers.get(), nullptr, content, out.get(), kFlags) != 1) {
      report(file, "was changed, or signed by another authority than " + std::string(kCaFile));
      return {};
    }
    char* text = nullptr;
    const long size = BIO_get_mem_data(out.get(), &text);
    std::string result(text, static_cast<std::size_t>(size));
    if (result.find(root) != std::string::npos)
      return result;
    report(file, "is a signed document of another kind");
    return {};
  }

  void check_permissions() {
    const std::string text = document(kPermissionsFile, "<permissions>");
    if (text.empty())
      return;
    const std::string expected = subject_of(*certificate_);
    const std::string found = content_of("subject_name", text);
    if (found != expected) {
      const bool reordered = parts_of(found) == parts_of(expected);
      report(kPermissionsFile,
             std::string("is for ") +
                 (reordered ? "the same subject in another order, \"" : "another subject, \"") +
                 found + "\": write <subject_name>" + expected + "</subject_name>, as in " +
                 kCertificateFile);
    }
    const std::string now = xml_time(now_);
    if (content_of("not_before", text) > now) {
      report(kPermissionsFile, "is not valid yet, but from " + content_of("not_before", text) +
                                   " UTC" + kCompareClock);
    } else if (content_of("not_after", text) <= now) {
      report(kPermissionsFile,
             "has expired, on " + content_of("not_after", text) + " UTC: " + kIssueAgain);
    }
    check_topics(text);
  }

  // Reports one topic only: a rule is for all lines and devices, and a new identity has all rules.
  void check_topics(const std::string& text) {
    if (!text.empty() && check_topics(text, "publish", "the named topic ", topics_.published) &&
        check_topics(text, "subscribe", "the named topic ", topics_.received))
      check_topics(text, "subscribe", "the topic of other gateways ", topics_.followed);
  }
  // Returns false after an error.
  bool check_topics(const std::string& text, const std::string& action, const std::string& what,
                    const std::vector<std::string>& topics) {
    const std::vector<std::string> rules = contents_of(action, text);
    for (const std::string& topic : topics) {
      const auto matches = [&](const std::string& expression) {
        return ::fnmatch(expression.c_str(), topic.c_str(), FNM_NOESCAPE) == 0;
      };
      const auto permits = [&](const std::string& rule) {
        return std::ranges::any_of(contents_of("topic", rule), matches);
      };
      if (std::ranges::any_of(rules, permits))
        continue;
      report(kPermissionsFile, "does not permit the gateway to " + action + " " + what + topic +
                                   ", because it was issued by an earlier version: issue the "
                                   "identity again (linegate security issue --renew), copy its "
                                   "folder to this host, and restart the gateway");
      return false;
    }
    return true;
  }

  // The partitions of commands, as the library compares them. Without lines the role is checked.
  void check_lines(const std::vector<std::string>& lines) {
    const auto identity = identity_of(folder_);
    if (!identity)
      return;
    if (identity->role != Role::operator_ && identity->role != Role::engineer)
      return report(kCertificateFile, "is of role " + std::string(name(identity->role)) +
                                          ", which sends no requests: issue an identity of role "
                                          "operator (to read) or engineer (to read and write)");
    const std::string text = document(kPermissionsFile, "<permissions>");
    if (text.empty())
      return;
    const std::string end = "/" + std::string(name(identity->role)) + "/" + identity->name;
    for (const std::string& line : lines) {
      if (!permits_commands(text, line + end))
        report(kPermissionsFile, "does not permit requests to " + line +
                                     ": issue the identity again with --line " + line +
                                     " and its other lines (linegate security issue --renew), copy "
                                     "its folder to this host, and restart the gateway");
    }
  }
  static bool permits_commands(const std::string& text, const std::string& partition) {
    const auto matches = [&](const std::string& expression) {
      return ::fnmatch(expression.c_str(), partition.c_str(), FNM_NOESCAPE) == 0;
    };
    return std::ranges::any_of(contents_of("publish", text), [&](const std::string& rule) {
      const auto topics = contents_of("topic", rule);
      return std::ranges::find(topics, "linegate/v1/CommandRequest") != topics.end() &&
             std::ranges::any_of(contents_of("partition", rule), matches);
    });
  }

  // Of the first element with that name; empty without one.
  static std::string content_of(const std::string& element, const std::string& text) {
    const std::string opening = "<" + element + ">";
    const std::size_t at = text.find(opening);
    if (at == std::string::npos)
      return {};
    const std::size_t begin = at + opening.size();
    return text.substr(begin, text.find("</" + element, begin) - begin);
  }

  // Of all elements with that name.
  static std::vector<std::string> contents_of(const std::string& element, const std::string& text) {
    const std::string opening = "<" + element + ">";
    std::vector<std::string> out;
    for (std::size_t at = text.find(opening); at != std::string::npos;
         at = text.find(opening, at + opening.size()))
      out.push_back(content_of(element, text.substr(at)));
    return out;
  }

  // The relative names of a subject, in an order of their own.
  static std::multiset<std::string> parts_of(const std::string& subject) {
    std::multiset<std::string> out;
    std::stringstream in(subject);
    for (std::string part; std::getline(in, part, ',');) {
      part.erase(0, part.find_first_not_of(' '));
      out.insert(part);
    }
    return out;
  }

  static std::string xml_time(std::time_t time) {
    std::tm parts{};
    ::gmtime_r(&time, &parts);
    return xml_time(parts);
  }

  static std::string xml_time(const std::tm& parts) {
    std::array<char, 32> text{};
    std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &parts);
    return text.data();
  }

  const std::string folder_;
  const std::time_t now_;
  const NamedTopics topics_;
  std::vector<Diagnostic> found_;
  Certificate ca_;
  Certificate certificate_;
};

}  // namespace

std::optional<Identity> identity_of(const std::string& folder) {
  const Certificate certificate =
      read_certificate((std::filesystem::path(folder) / kCertificateFile).string());
  if (!certificate)
    return std::nullopt;
  const auto role = parse_role(entry_of(*certificate, NID_organizationalUnitName));
  std::string name = entry_of(*certificate, NID_commonName);
  if (!role || name.empty())
    return std::nullopt;
  return Identity{std::move(name), *role};
}

std::vector<Diagnostic> check_gateway(const std::string& folder, const std::string& gateway,
                                      std::time_t now, const NamedTopics& topics) {
  if (folder.empty())
    return {};
  auto found = Check(folder, now, topics).take();
  const auto identity = identity_of(folder);
  if (identity && (identity->role != Role::gateway || identity->name != gateway)) {
    found.push_back({Severity::error, (std::filesystem::path(folder) / kCertificateFile).string(),
                     0, 0,
                     "is of " + std::string(name(identity->role)) + " \"" + identity->name +
                         "\": a gateway needs an identity of role gateway with its own name, \"" +
                         gateway + "\""});
  }
  return found;
}

std::vector<Diagnostic> check_named_topics(const std::string& folder, const NamedTopics& topics) {
  const bool any =
      !topics.published.empty() || !topics.received.empty() || !topics.followed.empty();
  return folder.empty() || !any ? std::vector<Diagnostic>{} : Check(folder, 0, topics).run_topics();
}

std::vector<Diagnostic> check_identity(const std::string& folder, std::time_t now) {
  return Check(folder, now).take();
}

std::vector<Diagnostic> check_requests(const std::string& folder, const std::string& of_gateway,
                                       const std::vector<std::string>& lines, std::time_t now) {
  return folder.empty() ? std::vector<Diagnostic>{}
                        : Check(folder, now).run_requests(of_gateway, lines);
}

std::vector<Diagnostic> check_request_lines(const std::string& folder,
                                            const std::vector<std::string>& lines) {
  return folder.empty() || lines.empty() ? std::vector<Diagnostic>{}
                                         : Check(folder, 0).run_lines(lines);
}

}  // namespace linegate::security
