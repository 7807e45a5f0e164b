// SPDX-License-Identifier: Apache-2.0
// Reads nodelist.cpj (CiA 306-3): the nodes in the networks of a plant, and their DCFs.
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
  std::uint16_t number = 1;  // 1 for [Topology], 2 for [Topology2]
  std::string name;
  std::string reference;
  std::string folder;             // EDSBaseName: folder of its files
  std::vector<ListedNode> nodes;  // present nodes, ascending by node-ID
  std::uint32_t line = 0;
};

struct NodeList {
  std::vector<ListedNetwork> networks;  // ascending by number
};

// The rules of eds::read(): content that cannot be parsed is an error, content that is inconsistent
// a warning, each with file, line and column.
Loaded<NodeList> read_node_list(std::string_view text, std::string_view file_name);

}  // namespace linegate::eds
