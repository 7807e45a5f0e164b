// SPDX-License-Identifier: Apache-2.0
// The files of Security as properties of a participant (Fast DDS 2.9, "Security" of its manual).
#pragma once

#include <string>

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>

#include "bridges/dds/security.h"

namespace linegate::dds {

inline void add_properties(const Security& security,
                           eprosima::fastdds::dds::DomainParticipantQos& qos) {
  const auto add = [&](const std::string& name, const std::string& value) {
    qos.properties().properties().emplace_back("dds.sec." + name, value);
  };
  const auto add_file = [&](const std::string& name, const std::string& path) {
    add(name, "file://" + path);
  };
  add("auth.plugin", "builtin.PKI-DH");
  add_file("auth.builtin.PKI-DH.identity_ca", security.ca);
  add_file("auth.builtin.PKI-DH.identity_certificate", security.certificate);
  add_file("auth.builtin.PKI-DH.identity_crl", security.revocations);
  add_file("auth.builtin.PKI-DH.private_key", security.key);
  add("access.plugin", "builtin.Access-Permissions");
  add_file("access.builtin.Access-Permissions.permissions_ca", security.ca);
  add_file("access.builtin.Access-Permissions.governance", security.governance);
  add_file("access.builtin.Access-Permissions.permissions", security.permissions);
  add("crypto.plugin", "builtin.AES-GCM-GMAC");
}

}  // namespace linegate::dds
