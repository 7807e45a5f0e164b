// SPDX-License-Identifier: Apache-2.0
#include "gateway/security/identity_check.h"

#include <array>
#include <cerrno>
#include <filesystem>
#include <set>
#include <sstream>
#include <utility>

#include <sys/stat.h>

#include "gateway/security/files.h"
#include "gateway/security/openssl.h"

namespace linegate::security {
namespace {

constexpr std::time_t kSoon = 30L * 24 * 60 * 60;

class Check {
 public:
  Check(const std::string& folder, std::time_t now) : folder_(folder), now_(now) {}

  std::vector<Diagnostic> run() {
    for (const char* file :
         {kCaFile, kCertificateFile, kKeyFile, kGovernanceFile, kPermissionsFile, kRevocationsFile})
      check_file(file);
    if (has_errors(found_))
      return std::move(found_);
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
    return std::move(found_);
  }

 private:
  std::string path(const char* file) const {
    return (std::filesystem::path(folder_) / file).string();
  }
  void report(const char* file, std::string text, Severity severity = Severity::error) {
    found_.push_back({severity, path(file), 0, 0, std::move(text)});
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

  void check_validity(const char* file, const X509& it) {
    std::time_t now = now_;
    std::time_t soon = now_ + kSoon;
    if (X509_cmp_time(X509_get0_notBefore(&it), &now) > 0) {
      report(file, "is not valid yet: compare the clock of this host");
    } else if (X509_cmp_time(X509_get0_notAfter(&it), &now) < 0) {
      report(file, "has expired: issue the identity again");
    } else if (X509_cmp_time(X509_get0_notAfter(&it), &soon) < 0) {
      report(file, "expires within 30 days", Severity::warning);
    }
  }

  void check_certificates() {
    ca_ = read_certificate(path(kCaFile));
    certificate_ = read_certificate(path(kCertificateFile));
    if (!ca_)
      return report(kCaFile, "is not a certificate in PEM");
    if (!certificate_)
      return report(kCertificateFile, "is not a certificate in PEM");
    check_validity(kCaFile, *ca_);
    check_validity(kCertificateFile, *certificate_);
    if (X509_verify(certificate_.get(), X509_get0_pubkey(ca_.get())) != 1)
      report(kCertificateFile, "was issued by another authority than " + std::string(kCaFile));
  }

  void check_key() {
    const Key key = read_key(path(kKeyFile));
    if (!key) {
      report(kKeyFile, "is not a private key in PEM, or has a password");
    } else if (certificate_ && X509_check_private_key(certificate_.get(), key.get()) != 1) {
      report(kKeyFile, "does not match " + std::string(kCertificateFile));
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
      report(kPermissionsFile, "is not valid yet: compare the clock of this host");
    } else if (content_of("not_after", text) <= now) {
      report(kPermissionsFile, "has expired: issue the identity again");
    }
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
    std::array<char, 32> text{};
    std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &parts);
    return text.data();
  }

  const std::string folder_;
  const std::time_t now_;
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
                                      std::time_t now) {
  if (folder.empty())
    return {};
  auto found = check_identity(folder, now);
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

std::vector<Diagnostic> check_identity(const std::string& folder, std::time_t now) {
  return Check(folder, now).run();
}

}  // namespace linegate::security
