#include "idl/wire/identity.hpp"

#include <openssl/pem.h>
#include <openssl/x509.h>
#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "idl/wire/domain.hpp"

namespace slew::wire {
namespace {

constexpr const char* kFiles[] = {"ca.pem", "certificate.pem", "key.pem", "governance.p7s",
                                  "permissions.p7s"};

using File = std::unique_ptr<std::FILE, decltype(&std::fclose)>;
using Certificate = std::unique_ptr<X509, decltype(&X509_free)>;

std::int64_t unix_s(const ASN1_TIME* time) {
  tm parts{};
  if (ASN1_TIME_to_tm(time, &parts) != 1) return 0;
  return timegm(&parts);
}

std::string day(std::int64_t unix_s) {
  const time_t time = unix_s;
  tm parts{};
  gmtime_r(&time, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

// Until when it holds; an identity that does not hold now would only be met with silence.
std::int64_t end_of(const std::filesystem::path& file) {
  const File stream(std::fopen(file.c_str(), "re"), std::fclose);
  const Certificate certificate(stream ? PEM_read_X509(stream.get(), nullptr, nullptr, nullptr) : nullptr,
                                X509_free);
  if (!certificate) throw WireError("the certificate " + file.string() + " cannot be read");
  const std::int64_t begin = unix_s(X509_get0_notBefore(certificate.get()));
  const std::int64_t end = unix_s(X509_get0_notAfter(certificate.get()));
  const std::int64_t now = std::time(nullptr);
  if (now < begin)
    throw WireError("the certificate " + file.string() + " holds from " + day(begin) + " only");
  if (now >= end) throw WireError("the certificate " + file.string() + " ran out on " + day(end));
  return end;
}

void replace_all(std::string& text, const std::string& what, const std::string& by) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
    text.replace(at, what.size(), by);
}

std::string escaped(std::string text) {
  replace_all(text, "&", "&amp;");
  replace_all(text, "<", "&lt;");
  return text;
}

}  // namespace

Identity::Identity(const std::filesystem::path& directory)
    : directory_(std::filesystem::absolute(directory)) {
  for (const char* name : kFiles) {
    const auto file = directory_ / name;
    const File stream(std::fopen(file.c_str(), "re"), std::fclose);
    if (!stream)
      throw WireError("the identity's file " + file.string() + " cannot be read: " + std::strerror(errno));
  }
  expires_unix_s_ = std::min(end_of(directory_ / "certificate.pem"), end_of(directory_ / "ca.pem"));
}

std::string Identity::joined_to(const std::string& profile) const {
  const auto file = [this](const char* name) { return "file:" + escaped((directory_ / name).string()); };
  const std::string security =
      "<Security><Authentication>"
      "<Library path=\"dds_security_auth\" initFunction=\"init_authentication\" "
      "finalizeFunction=\"finalize_authentication\"/>"
      "<IdentityCA>" +
      file("ca.pem") +
      "</IdentityCA>"
      "<IdentityCertificate>" +
      file("certificate.pem") +
      "</IdentityCertificate>"
      "<PrivateKey>" +
      file("key.pem") +
      "</PrivateKey>"
      "</Authentication><Cryptographic>"
      "<Library path=\"dds_security_crypto\" initFunction=\"init_crypto\" "
      "finalizeFunction=\"finalize_crypto\"/>"
      "</Cryptographic><AccessControl>"
      "<Library path=\"dds_security_ac\" initFunction=\"init_access_control\" "
      "finalizeFunction=\"finalize_access_control\"/>"
      "<Governance>" +
      file("governance.p7s") +
      "</Governance>"
      "<PermissionsCA>" +
      file("ca.pem") +
      "</PermissionsCA>"
      "<Permissions>" +
      file("permissions.p7s") +
      "</Permissions>"
      "</AccessControl></Security></Domain>";
  std::string joined = profile;
  replace_all(joined, "</Domain>", security);
  if (joined == profile)
    throw WireError("the DDS profile has no <Domain> that an identity could be joined to");
  return joined;
}

}  // namespace slew::wire
