// SPDX-License-Identifier: Apache-2.0
#include "gateway/security/authority.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <openssl/rand.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "gateway/config/certificate_name.h"
#include "gateway/security/files.h"
#include "gateway/security/openssl.h"
#include "gateway/security/revoked_names.h"

namespace linegate::security {
namespace {

namespace files = std::filesystem;

constexpr std::array kAuthorityFiles{kCaFile, kCaKeyFile, kGovernanceFile, kRevocationsFile,
                                     kRevokedNamesFile};
constexpr long kDay = 24L * 60 * 60;
constexpr mode_t kPrivate = 0600;
constexpr mode_t kPublic = 0644;

struct Authority {
  Certificate certificate;
  Key key;
};

std::string content_of(const Bio& bio) {
  char* text = nullptr;
  const long size = BIO_get_mem_data(bio.get(), &text);
  return {text, static_cast<std::size_t>(size)};
}

bool write_all(int file, std::string_view content) {
  while (!content.empty()) {
    const ssize_t size = ::write(file, content.data(), content.size());
    if (size < 0)
      return false;
    content.remove_prefix(static_cast<std::size_t>(size));
  }
  return true;
}

// Replaces the file in one step: a participant that starts meanwhile reads the old or the new one.
// A failure leaves the old one only.
std::string write_file(const files::path& path, const std::string& content, mode_t mode) {
  const std::string beside = path.string() + ".new";
  ::unlink(beside.c_str());
  const int file = ::open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (file < 0)
    return path.string() + " cannot be written: " + std::strerror(errno);
  const bool written = write_all(file, content) && ::fchmod(file, mode) == 0 && ::fsync(file) == 0;
  int error = written ? 0 : errno;
  if (::close(file) != 0 && error == 0)
    error = errno;
  if (error == 0 && ::rename(beside.c_str(), path.c_str()) != 0)
    error = errno;
  if (error == 0)
    return {};
  ::unlink(beside.c_str());
  return path.string() + " cannot be written: " + std::strerror(error);
}

std::string write_key(const files::path& path, EVP_PKEY* key) {
  const Bio out(BIO_new(BIO_s_secmem()));
  if (key == nullptr ||
      PEM_write_bio_PrivateKey(out.get(), key, nullptr, nullptr, 0, nullptr, nullptr) != 1)
    return "OpenSSL cannot make a key";
  return write_file(path, content_of(out), kPrivate);
}

std::string write_certificate(const files::path& path, X509* certificate) {
  const Bio out(BIO_new(BIO_s_mem()));
  if (PEM_write_bio_X509(out.get(), certificate) != 1)
    return "OpenSSL cannot encode the certificate";
  return write_file(path, content_of(out), kPublic);
}

// As `openssl smime -sign -text`, which Fast DDS expects.
std::string write_signed(const files::path& path, const std::string& text, const Authority& by) {
  const Bio in(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
  const Bio out(BIO_new(BIO_s_mem()));
  constexpr int kFlags = PKCS7_TEXT | PKCS7_DETACHED | PKCS7_STREAM;
  const Pkcs7 document(PKCS7_sign(by.certificate.get(), by.key.get(), nullptr, in.get(), kFlags));
  if (!document || SMIME_write_PKCS7(out.get(), document.get(), in.get(), kFlags) != 1)
    return "OpenSSL cannot sign " + path.string();
  return write_file(path, content_of(out), kPublic);
}

// Unique without a file of numbers (CA/Browser Forum Baseline Requirements 7.1: 64 random bits).
void set_random_serial(X509* certificate) {
  std::array<unsigned char, 16> octets{};
  RAND_bytes(octets.data(), octets.size());
  octets[0] = (octets[0] & 0x3FU) | 0x40U;  // positive, and always of the same length
  const std::unique_ptr<BIGNUM, Deleter<BN_free>> number(
      BN_bin2bn(octets.data(), octets.size(), nullptr));
  BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(certificate));
}

void add_extension(X509* to, X509* issuer, int id, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, to, nullptr, nullptr, 0);
  const std::unique_ptr<X509_EXTENSION, Deleter<X509_EXTENSION_free>> extension(
      X509V3_EXT_conf_nid(nullptr, &context, id, value));
  X509_add_ext(to, extension.get(), -1);
}

// Valid from one hour ago, because clocks of hosts differ.
Certificate new_certificate(EVP_PKEY* key, const std::string& name, std::string_view unit,
                            long days) {
  Certificate out(X509_new());
  X509_set_version(out.get(), X509_VERSION_3);
  set_random_serial(out.get());
  X509_gmtime_adj(X509_getm_notBefore(out.get()), -3600);
  X509_gmtime_adj(X509_getm_notAfter(out.get()), days * kDay);
  X509_set_subject_name(out.get(), make_subject(name, unit).get());
  X509_set_pubkey(out.get(), key);
  return out;
}

std::string xml_time(const ASN1_TIME* time) {
  std::tm parts{};
  ASN1_TIME_to_tm(time, &parts);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &parts);
  return text.data();
}

std::string load(const files::path& folder, Authority& out) {
  out.certificate = read_certificate(folder / kCaFile);
  out.key = read_key(folder / kCaKeyFile);
  if (!out.certificate || !out.key)
    return folder.string() + " has no usable " + kCaFile + " and " + kCaKeyFile +
           "; make an authority with `linegate security init`";
  if (X509_check_private_key(out.certificate.get(), out.key.get()) != 1)
    return (folder / kCaKeyFile).string() + " is not the key of " + kCaFile;
  return {};
}

// The list expires with the authority: Fast DDS refuses every participant after that time.
std::string write_revocations(const files::path& path, X509_CRL* list, const Authority& by) {
  X509_CRL_set_version(list, 1);
  X509_CRL_set_issuer_name(list, X509_get_subject_name(by.certificate.get()));
  const std::unique_ptr<ASN1_TIME, Deleter<ASN1_TIME_free>> now(X509_gmtime_adj(nullptr, -3600));
  X509_CRL_set1_lastUpdate(list, now.get());
  X509_CRL_set1_nextUpdate(list, X509_get0_notAfter(by.certificate.get()));
  X509_CRL_sort(list);
  const Bio out(BIO_new(BIO_s_mem()));
  if (X509_CRL_sign(list, by.key.get(), EVP_sha256()) == 0 ||
      PEM_write_bio_X509_CRL(out.get(), list) != 1)
    return "OpenSSL cannot sign " + path.string();
  return write_file(path, content_of(out), kPublic);
}

std::string copy(const files::path& from, const files::path& to, const char* name) {
  const files::path beside = to / (std::string(name) + ".new");
  std::error_code error;
  files::copy_file(from / name, beside, files::copy_options::overwrite_existing, error);
  if (!error)
    files::rename(beside, to / name, error);
  if (!error)
    return {};
  std::error_code ignored;
  files::remove(beside, ignored);
  return (to / name).string() + " cannot be written: " + error.message();
}

bool is_revoked(const files::path& folder, X509* certificate) {
  const RevocationList list = read_revocations(folder / kRevocationsFile);
  X509_REVOKED* entry = nullptr;
  return list && X509_CRL_get0_by_cert(list.get(), &entry, certificate) == 1;
}

// Also excludes wildcards and slashes other than the one between gateway and line.
bool is_line(const std::string& line) {
  const std::size_t slash = line.find('/');
  if (slash == std::string::npos)
    return false;
  const std::string gateway = line.substr(0, slash);
  const std::string name = line.substr(slash + 1);
  return (gateway == "*" || config::is_certificate_name(gateway)) &&
         (name == "*" || name.empty() || config::is_certificate_name(name));
}

// Also the name of each file while it is written.
bool is_authority_file(const std::string& name) {
  return std::any_of(kAuthorityFiles.begin(), kAuthorityFiles.end(), [&](const char* file) {
    return name == file || name == std::string(file) + ".new";
  });
}

std::string refuse(const files::path& folder, const Issue& issue) {
  const std::string& name = issue.holder.name;
  if (issue.days < 1 || issue.days > kAuthorityDays)
    return std::to_string(issue.days) + " days: 1 to " + std::to_string(kAuthorityDays) +
           " are possible";
  if (!config::is_certificate_name(name))
    return "\"" + name +
           "\" is no name of an identity: use 1 to 64 of A-Z a-z 0-9 . - _, not beginning with a "
           "point";
  if (is_authority_file(name))
    return "\"" + name + "\" is a file of the authority: use another name";
  for (const std::string& line : issue.holder.lines) {
    if (!is_line(line))
      return "\"" + line + "\" names no line: use GATEWAY/LINE, with * for all names";
  }
  std::error_code ignored;
  if (files::symlink_status(folder / name, ignored).type() == files::file_type::not_found)
    return issue.renew ? "there is no identity " + (folder / name).string() +
                             " to renew: issue it without --renew"
                       : std::string();
  const Certificate before = read_certificate(folder / name / kCertificateFile);
  if (!before)
    return (folder / name).string() + " exists, and is no identity, because it has no readable " +
           kCertificateFile + ": use another name, or move it to another place";
  const std::string role = entry_of(*before, NID_organizationalUnitName);
  if (issue.renew && role != security::name(issue.holder.role))
    return "\"" + name + "\" is of role " + role +
           ": revoke it before you issue it with another role";
  if (issue.renew || is_revoked(folder, before.get()))
    return {};
  return (folder / name).string() + " exists: revoke \"" + name +
         "\" before you issue it again, or use --renew";
}

// The lines that the permissions of an identity name, as in Holder. Nothing if they cannot be read.
// The text of the signed document is legible.
std::vector<std::string> lines_of(const files::path& own, const Holder& holder) {
  constexpr std::string_view kOpening = "<partition>";
  const std::string closing =
      "/" + std::string(name(holder.role)) + "/" + holder.name + "</partition>";
  std::ifstream in(own / kPermissionsFile);
  std::vector<std::string> out;
  for (std::string text; std::getline(in, text) && text.find("</publish>") == std::string::npos;) {
    const std::size_t begin = text.find(kOpening);
    const std::size_t end = text.find(closing);
    if (begin != std::string::npos && end != std::string::npos)
      out.push_back(text.substr(begin + kOpening.size(), end - begin - kOpening.size()));
  }
  return out;
}

// Replaces the lines of an operator or engineer that is renewed with those it has. Returns why not.
std::string keep_lines(const files::path& folder, Holder& holder) {
  if (holder.role != Role::operator_ && holder.role != Role::engineer)
    return {};
  holder.lines = lines_of(folder / holder.name, holder);
  return holder.lines.empty() ? (folder / holder.name / kPermissionsFile).string() +
                                    " names no lines: name them with --line"
                              : std::string();
}

Certificate new_identity(EVP_PKEY* key, const Authority& by, const Issue& issue) {
  Certificate made = new_certificate(key, issue.holder.name, name(issue.holder.role), issue.days);
  const ASN1_TIME* last = X509_get0_notAfter(by.certificate.get());
  if (ASN1_TIME_compare(X509_get0_notAfter(made.get()), last) > 0)
    X509_set1_notAfter(made.get(), last);
  X509_set_issuer_name(made.get(), X509_get_subject_name(by.certificate.get()));
  add_extension(made.get(), by.certificate.get(), NID_basic_constraints, "critical,CA:FALSE");
  add_extension(made.get(), by.certificate.get(), NID_authority_key_identifier, "keyid");
  if (X509_sign(made.get(), by.key.get(), EVP_sha256()) == 0)
    made.reset();
  return made;
}

std::string write_identity(const files::path& folder, const files::path& own, const Authority& by,
                           const Issue& issue) {
  const Key key(EVP_EC_gen("P-256"));
  const Certificate made = key ? new_identity(key.get(), by, issue) : nullptr;
  if (!made)
    return "OpenSSL cannot make a key and its certificate";
  for (const char* file : {kCaFile, kGovernanceFile, kRevocationsFile}) {
    if (std::string failed = copy(folder, own, file); !failed.empty())
      return failed;
  }
  const std::string document =
      permissions(issue.holder, subject_of(*made), xml_time(X509_get0_notBefore(made.get())),
                  xml_time(X509_get0_notAfter(made.get())));
  std::string error = write_key(own / kKeyFile, key.get());
  if (error.empty())
    error = write_signed(own / kPermissionsFile, document, by);
  return error.empty() ? write_certificate(own / kCertificateFile, made.get()) : error;
}

// Each certificate that was issued, by the name of its identity: they are revoked with the
// identity, even if its subfolder has another certificate or is missing.
constexpr const char* kIssuedFolder = ".issued";
// The same of an authority before kIssuedFolder: the certificates that a renewal replaced.
constexpr const char* kReplacedFolder = ".replaced";

files::path issued(const files::path& folder, const std::string& name) {
  return folder / kIssuedFolder / name;
}

// The file of a certificate that was issued, by its serial number in hexadecimal.
files::path issued_file(const files::path& folder, const std::string& name, X509* certificate) {
  const std::unique_ptr<BIGNUM, Deleter<BN_free>> number(
      ASN1_INTEGER_to_BN(X509_get0_serialNumber(certificate), nullptr));
  const std::unique_ptr<char, void (*)(char*)> serial(BN_bn2hex(number.get()),
                                                      [](char* text) { OPENSSL_free(text); });
  return issued(folder, name) / (std::string(serial.get()) + ".crt");
}

std::string keep_issued(const files::path& folder, const std::string& name, X509* certificate) {
  std::error_code error;
  files::create_directories(issued(folder, name), error);
  if (error)
    return issued(folder, name).string() + " cannot be created: " + error.message();
  return write_certificate(issued_file(folder, name, certificate), certificate);
}

// The present certificate of an identity, which an older authority has not kept, and the new one.
std::string keep_certificates(const files::path& folder, const files::path& made,
                              const std::string& name) {
  const Certificate present = read_certificate(folder / name / kCertificateFile);
  std::string failed = present ? keep_issued(folder, name, present.get()) : std::string();
  const Certificate next = read_certificate(made / kCertificateFile);
  return failed.empty() ? keep_issued(folder, name, next.get()) : failed;
}

// Those of an identity, the present one first. Empty if it was never issued.
std::vector<Certificate> certificates_of(const files::path& folder, const std::string& name) {
  std::vector<Certificate> out;
  if (Certificate present = read_certificate(folder / name / kCertificateFile))
    out.push_back(std::move(present));
  for (const char* kept : {kIssuedFolder, kReplacedFolder}) {
    std::error_code error;
    for (const auto& each : files::directory_iterator(folder / kept / name, error)) {
      if (Certificate one = read_certificate(each.path()))
        out.push_back(std::move(one));
    }
  }
  return out;
}

void add_revocation(X509_CRL* list, const X509* certificate) {
  X509_REVOKED* entry = X509_REVOKED_new();
  X509_REVOKED_set_serialNumber(
      entry, const_cast<ASN1_INTEGER*>(X509_get0_serialNumber(certificate)));  // only copied
  const std::unique_ptr<ASN1_TIME, Deleter<ASN1_TIME_free>> now(X509_gmtime_adj(nullptr, 0));
  X509_REVOKED_set_revocationDate(entry, now.get());
  X509_CRL_add0_revoked(list, entry);  // takes the entry
}

std::string no_revoked_names(const files::path& folder) {
  return (folder / kRevokedNamesFile).string() +
         " cannot be read: copy it from the folder of an identity";
}

std::string write_revoked_names(const files::path& folder, const NameSet& names) {
  std::string text;
  for (const std::string& name : names)
    text += name + "\n";
  return write_file(folder / kRevokedNamesFile, text, kPublic);
}

void add_failure(std::string& to, const std::string& failed) {
  if (!to.empty() && !failed.empty())
    to += "; ";
  to += failed;
}

// To all identities that it can be copied to. Returns every failure.
std::string copy_to_identities(const files::path& folder, const char* file) {
  std::string out;
  std::error_code error;
  for (files::directory_iterator each(folder, error), end; !error && each != end;
       each.increment(error)) {
    std::error_code ignored;
    if (files::exists(each->path() / kCertificateFile, ignored))
      add_failure(out, copy(folder, each->path(), file));
  }
  if (error)
    add_failure(out, folder.string() + " cannot be read: " + error.message());
  return out;
}

// The names are first, because running gateways need them. list: null if it has not changed. Each
// step is done even if another one failed, and both files are copied even if nothing has changed:
// so the next command completes what a failure left.
std::string publish_revocations(const files::path& folder, const NameSet& names, X509_CRL* list,
                                const Authority& by) {
  std::string out = write_revoked_names(folder, names);
  add_failure(out, copy_to_identities(folder, kRevokedNamesFile));
  if (list != nullptr)
    add_failure(out, write_revocations(folder / kRevocationsFile, list, by));
  add_failure(out, copy_to_identities(folder, kRevocationsFile));
  return out;
}

// Removes the name of an identity that was issued from the revoked names.
std::string permit_again(const files::path& folder, const Holder& holder, NameSet names) {
  names.erase(std::string(name(holder.role)) + "/" + holder.name);
  std::string failed = write_revoked_names(folder, names);
  if (failed.empty())
    failed = copy_to_identities(folder, kRevokedNamesFile);
  return failed.empty() ? failed
                        : "\"" + holder.name + "\" was issued, but " + failed +
                              ": correct this, and issue it again with --renew";
}

// Puts the new folder in the place of the old one, if there is one, in one step.
std::string replace(const files::path& made, const files::path& own) {
  std::error_code error;
  const bool exists = files::exists(own, error);
  const unsigned flags = exists ? RENAME_EXCHANGE : RENAME_NOREPLACE;
  if (::renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, own.c_str(), flags) != 0)
    return own.string() + " cannot be written: " + std::strerror(errno);
  return {};
}

// All files of a new authority; its certificate is the last.
std::string write_authority(const files::path& at) {
  Authority made{nullptr, Key(EVP_EC_gen("P-256"))};
  if (!made.key)
    return "OpenSSL cannot make a key";
  // A name of its own: certificates of two authorities are not confused.
  made.certificate = new_certificate(made.key.get(), "authority", {}, kAuthorityDays);
  X509* ca = made.certificate.get();
  X509_set_issuer_name(ca, X509_get_subject_name(ca));
  add_extension(ca, ca, NID_subject_key_identifier, "hash");
  add_extension(ca, ca, NID_basic_constraints, "critical,CA:TRUE");
  if (X509_sign(ca, made.key.get(), EVP_sha256()) == 0)
    return "OpenSSL cannot sign the certificate";
  const RevocationList none(X509_CRL_new());
  std::string failed = write_key(at / kCaKeyFile, made.key.get());
  if (failed.empty())
    failed = write_signed(at / kGovernanceFile, governance(), made);
  if (failed.empty())
    failed = write_revocations(at / kRevocationsFile, none.get(), made);
  if (failed.empty())
    failed = write_revoked_names(at, {});
  return failed.empty() ? write_certificate(at / kCaFile, ca) : failed;
}

// All certificates of an identity.
std::string revoke_all(const files::path& at, const std::string& name,
                       const std::vector<Certificate>& certificates, const Authority& by) {
  const RevocationList list = read_revocations(at / kRevocationsFile);
  if (!list)
    return (at / kRevocationsFile).string() + " is no revocation list";
  auto names = read_revoked_names((at / kRevokedNamesFile).string());
  if (!names)
    return no_revoked_names(at);
  bool changed = false;
  for (const Certificate& certificate : certificates) {
    names->insert(entry_of(*certificate, NID_organizationalUnitName) + "/" + name);
    X509_REVOKED* entry = nullptr;
    if (X509_CRL_get0_by_cert(list.get(), &entry, certificate.get()) == 1)
      continue;
    add_revocation(list.get(), certificate.get());
    changed = true;
  }
  std::string error = publish_revocations(at, *names, changed ? list.get() : nullptr, by);
  if (!error.empty())
    return error + ": correct this, and revoke \"" + name + "\" again";
  return changed ? std::string() : "\"" + name + "\" is revoked already";
}

// Only one command at a time changes an authority.
class Lock {
 public:
  explicit Lock(const files::path& folder)
      : folder_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    if (folder_ >= 0)
      ::flock(folder_, LOCK_EX);
  }
  ~Lock() {
    if (folder_ >= 0)
      ::close(folder_);
  }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

 private:
  int folder_;
};

}  // namespace

std::string init(const std::string& folder) {
  const files::path at(folder);
  std::error_code error;
  const bool is_new = files::create_directories(at, error);
  if (error)
    return folder + " cannot be created: " + error.message();
  const Lock lock(folder);
  for (const char* file : kAuthorityFiles) {
    if (files::exists(at / file, error))
      return (at / file).string() + " exists: the folder has an authority already";
  }
  std::string failed = write_authority(at);
  if (failed.empty())
    return {};
  for (const char* file : kAuthorityFiles)
    files::remove(at / file, error);
  if (is_new)
    files::remove(at, error);
  return failed;
}

std::string issue(const std::string& folder, const Issue& wanted) {
  const Lock lock(folder);
  Authority by;
  Issue issue = wanted;
  if (std::string error = load(folder, by); !error.empty())
    return error;
  const files::path at(folder);
  if (std::string error = refuse(at, issue); !error.empty())
    return error;
  if (issue.renew && issue.keep_lines) {
    if (std::string error = keep_lines(at, issue.holder); !error.empty())
      return error;
  }
  auto names = read_revoked_names((at / kRevokedNamesFile).string());
  if (!names)
    return no_revoked_names(at);
  const files::path made = at / ("." + issue.holder.name + ".new");
  std::error_code error;
  files::remove_all(made, error);  // of a command that was killed
  files::create_directory(made, error);
  if (!error)
    files::permissions(made, files::perms::owner_all, error);
  if (error)
    return made.string() + " cannot be created: " + error.message();
  std::string failed = write_identity(at, made, by, issue);
  if (failed.empty())
    failed = copy(at, made, kRevokedNamesFile);
  if (failed.empty())
    failed = keep_certificates(at, made, issue.holder.name);
  if (failed.empty())
    failed = replace(made, at / issue.holder.name);
  files::remove_all(made, error);
  return failed.empty() ? permit_again(at, issue.holder, std::move(*names)) : failed;
}

std::string revoke(const std::string& folder, const std::string& name) {
  const Lock lock(folder);
  Authority by;
  if (std::string error = load(folder, by); !error.empty())
    return error;
  const files::path at(folder);
  if (!config::is_certificate_name(name))
    return "\"" + name + "\" is no name of an identity";
  const std::vector<Certificate> certificates = certificates_of(at, name);
  if (certificates.empty())
    return "no identity \"" + name + "\" was issued here: if you have a copy of its " +
           kCertificateFile + ", revoke it with --certificate";
  return revoke_all(at, name, certificates, by);
}

std::string revoke_certificate(const std::string& folder, const std::string& file) {
  const Lock lock(folder);
  Authority by;
  if (std::string error = load(folder, by); !error.empty())
    return error;
  Certificate certificate = read_certificate(file);
  if (!certificate)
    return file + " is not a certificate in PEM";
  if (X509_verify(certificate.get(), X509_get0_pubkey(by.certificate.get())) != 1)
    return file + " was issued by another authority than " +
           (files::path(folder) / kCaFile).string();
  const std::string name = entry_of(*certificate, NID_commonName);
  if (!config::is_certificate_name(name) ||
      !parse_role(entry_of(*certificate, NID_organizationalUnitName)))
    return file + " is not the certificate of an identity";
  std::vector<Certificate> certificates = certificates_of(folder, name);
  certificates.push_back(std::move(certificate));
  return revoke_all(folder, name, certificates, by);
}

}  // namespace linegate::security
