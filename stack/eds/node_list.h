// SPDX-License-Identifier: Apache-2.0
// Reading nodelist.cpj (CiA 306-3): which nodes the networks of a plant have, and their DCFs.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "stack/base/diagnostic.h"

namespace linegate::eds {

struct ListedNode {
  std::uint8_t id = 0;    // 1..127
  std::string name;       // UTF-8; may be empty
  std::string reference;  // NodeRefd, a designator of the plant
  std::string dcf;        // file name, relative to the network's folder; may be empty
  std::uint32_t line = 0;
};

struct ListedNetwork {
  std::uint16_t number = 1;  // of [Topology] 1, of [Topology2] 2
  std::string name;
  std::string reference;
  std::string folder;             // EDSBaseName: where its files are
  std::vector<ListedNode> nodes;  // those that are present, ascending by node-ID
  std::uint32_t line = 0;
};

struct NodeList {
  std::vector<ListedNetwork> networks;  // ascending by number
};

// The rules of eds::read(): what cannot be understood is an error, what is merely wrong a warning,
// each with file, line and column.
Loaded<NodeList> read_node_list(std::string_view text, std::string_view file_name);

}  // namespace linegate::eds
