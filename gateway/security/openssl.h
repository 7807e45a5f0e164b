// SPDX-License-Identifier: Apache-2.0
// Owners of OpenSSL objects, and their PEM files.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/pkcs7.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

namespace linegate::security {

template <auto Free>
struct Deleter {
  template <class T>
  void operator()(T* object) const {
    Free(object);
  }
};

using Bio = std::unique_ptr<BIO, Deleter<BIO_free_all>>;
using Key = std::unique_ptr<EVP_PKEY, Deleter<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Deleter<X509_free>>;
using RevocationList = std::unique_ptr<X509_CRL, Deleter<X509_CRL_free>>;
using Name = std::unique_ptr<X509_NAME, Deleter<X509_NAME_free>>;
using Pkcs7 = std::unique_ptr<PKCS7, Deleter<PKCS7_free>>;

inline Bio open_file(const std::string& path) {
  return Bio(BIO_new_file(path.c_str(), "r"));
}
// Each returns null if the file cannot be read, or does not contain such an object in PEM.
inline Certificate read_certificate(const std::string& path) {
  const Bio in = open_file(path);
  return Certificate(in ? PEM_read_bio_X509(in.get(), nullptr, nullptr, nullptr) : nullptr);
}
inline RevocationList read_revocations(const std::string& path) {
  const Bio in = open_file(path);
  return RevocationList(in ? PEM_read_bio_X509_CRL(in.get(), nullptr, nullptr, nullptr) : nullptr);
}
// Keys with a password are refused: nobody can enter one when a service starts.
inline Key read_key(const std::string& path) {
  const auto no_password = [](char*, int, int, void*) { return -1; };
  const Bio in = open_file(path);
  return Key(in ? PEM_read_bio_PrivateKey(in.get(), nullptr, no_password, nullptr) : nullptr);
}

// The subject in the order of RFC 2253, as in `subject_name` of a permissions document.
inline std::string subject_of(const X509& certificate) {
  const Bio out(BIO_new(BIO_s_mem()));
  X509_NAME_print_ex(out.get(), X509_get_subject_name(&certificate), 0, XN_FLAG_RFC2253);
  char* text = nullptr;
  const long size = BIO_get_mem_data(out.get(), &text);
  return {text, static_cast<std::size_t>(size)};
}

// The subject of an identity: O=linegate, OU=role, CN=name. The role is omitted if it is empty.
inline Name make_subject(std::string_view name, std::string_view role) {
  Name out(X509_NAME_new());
  const auto add = [&](const char* field, std::string_view value) {
    X509_NAME_add_entry_by_txt(out.get(), field, MBSTRING_UTF8,
                               reinterpret_cast<const unsigned char*>(value.data()),
                               static_cast<int>(value.size()), -1, 0);
  };
  add("O", "linegate");
  if (!role.empty())
    add("OU", role);
  add("CN", name);
  return out;
}

// The first value of that field of the subject in UTF-8; empty without one.
inline std::string entry_of(const X509& certificate, int field) {
  X509_NAME* subject = X509_get_subject_name(&certificate);
  const int at = X509_NAME_get_index_by_NID(subject, field, -1);
  if (at < 0)
    return {};
  unsigned char* text = nullptr;
  const int size =
      ASN1_STRING_to_UTF8(&text, X509_NAME_ENTRY_get_data(X509_NAME_get_entry(subject, at)));
  std::string out(reinterpret_cast<const char*>(text), size < 0 ? 0U : std::size_t(size));
  OPENSSL_free(text);
  return out;
}

}  // namespace linegate::security
