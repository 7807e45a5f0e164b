// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/plant.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/line/line.h"
#include "stack/od/dictionary.h"

#include "tests/paths.h"

namespace linegate::config {
namespace {

using namespace std::chrono_literals;

const std::string kRoot = paths::in_repository("");

Loaded<Plant> read_text(const std::string& text) {
  return read(text, kRoot + "plant.yaml");
}

// The messages as printed, with file names relative to the root of the repository.
std::vector<std::string> messages(const Loaded<Plant>& loaded) {
  std::vector<std::string> out;
  for (const auto& diagnostic : loaded.diagnostics) {
    std::string text = to_string(diagnostic);
    for (std::size_t at = text.find(kRoot); at != std::string::npos; at = text.find(kRoot)) {
      text.erase(at, kRoot.size());
    }
    out.push_back(std::move(text));
  }
  return out;
}

struct Bad {
  const char* name;
  const char* text;
  std::vector<std::string> expected;
};

class BadPlant : public testing::TestWithParam<Bad> {};

TEST_P(BadPlant, IsToldWithItsPlace) {
  const auto loaded = read_text(GetParam().text);
  EXPECT_FALSE(loaded.ok());
  EXPECT_EQ(messages(loaded), GetParam().expected);
}

const Bad kBad[] = {
    {"empty",
     "",
     {"plant.yaml: error: the configuration is a mapping (\"key: value\"), not nothing"}},
    {"not_yaml",
     "schema: 1\nlines: [\n",
     {"plant.yaml:3:1: error: this is not YAML: end of sequence flow not found"}},
    {"missing_keys",
     "gateway: {name: a}\n",
     {"plant.yaml:1:1: error: the configuration needs the key \"schema\"",
      "plant.yaml:1:1: error: the configuration needs the key \"lines\""}},
    {"schema",
     "schema: 2\nlines: [{name: a, interface: 'simulated:'}]\n",
     {"plant.yaml:1:9: error: expected a number from 1 to 1, got \"2\""}},
    {"no_line", "schema: 1\nlines: []\n", {"plant.yaml:2:8: error: there is no line in lines"}},
    {"unknown_keys_everywhere",
     "schema: 1\n"
     "gatewy: {}\n"
     "gateway: {nmae: a}\n"
     "lines:\n"
     "  - name: a\n"
     "    interface: 'simulated:'\n"
     "    hartbeat: 1s\n"
     "    wibble: 1\n",
     {"plant.yaml:2:1: error: unknown key \"gatewy\" in the configuration; did you mean "
      "\"gateway\"?",
      "plant.yaml:3:11: error: unknown key \"nmae\" in gateway; did you mean \"name\"?",
      "plant.yaml:7:5: error: unknown key \"hartbeat\" in a line; did you mean \"heartbeat\"?",
      "plant.yaml:8:5: error: unknown key \"wibble\" in a line"}},
    {"names_of_nodes",
     "schema: 1\nlines:\n"
     "  - name: a\n    interface: 'simulated:'\n    nodes:\n"
     "      - {id: 1, name: all}\n      - {id: 2, name: own}\n      - {id: 3, name: '12'}\n"
     "  - name: b\n    interface: 'simulated:'\n    role: device\n    devices:\n"
     "      - {id: 4, name: all}\n",
     {"plant.yaml:6:9: error: a node needs the key \"eds\" (or \"dcf\")",
      "plant.yaml:6:23: error: a node cannot be called \"all\", which has another meaning in "
      "commands: all, own and numbers",
      "plant.yaml:7:9: error: a node needs the key \"eds\" (or \"dcf\")",
      "plant.yaml:7:23: error: a node cannot be called \"own\", which has another meaning in "
      "commands: all, own and numbers",
      "plant.yaml:8:9: error: a node needs the key \"eds\" (or \"dcf\")",
      "plant.yaml:8:23: error: a node cannot be called \"12\", which has another meaning in "
      "commands: all, own and numbers",
      "plant.yaml:13:9: error: a device needs the key \"eds\" (or \"dcf\")",
      "plant.yaml:13:23: error: a node cannot be called \"all\", which has another meaning in "
      "commands: all, own and numbers"}},
    {"names_of_lines",
     "schema: 1\nlines:\n"
     "  - {name: '2', interface: 'virtual:a', network_id: 1}\n"
     "  - {name: all, interface: 'virtual:b', network_id: 2}\n"
     "  - {name: own, interface: 'virtual:c', network_id: 3}\n"
     "  - {name: '--help', interface: 'virtual:d', network_id: 4}\n"
     "  - {name: '2-a', interface: 'virtual:e', network_id: 5}\n",
     {"plant.yaml:3:12: error: a line cannot be called \"2\", which has another meaning in "
      "commands: all, own, numbers (network-IDs) and names that begin with '-' (options)",
      "plant.yaml:4:12: error: a line cannot be called \"all\", which has another meaning in "
      "commands: all, own, numbers (network-IDs) and names that begin with '-' (options)",
      "plant.yaml:5:12: error: a line cannot be called \"own\", which has another meaning in "
      "commands: all, own, numbers (network-IDs) and names that begin with '-' (options)",
      "plant.yaml:6:12: error: a line cannot be called \"--help\", which has another meaning in "
      "commands: all, own, numbers (network-IDs) and names that begin with '-' (options)"}},
    {"key_twice",
     "schema: 1\nlines:\n  - name: a\n    interface: 'simulated:'\n    sync: 10ms\n    sync: "
     "20ms\n",
     {"plant.yaml:6:5: error: the key \"sync\" is there twice"}},
    {"places",
     "schema: 1\ndds: {interfaces: [\"\", {a: b}], peers: [a b]}\nlines:\n  - name: a\n    "
     "interface: "
     "'simulated:'\n",
     {"plant.yaml:2:20: error: expected a name or an IPv4 address in \"interfaces\"",
      "plant.yaml:2:24: error: expected a name or an IPv4 address in \"interfaces\"",
      "plant.yaml:2:41: error: expected a name or an IPv4 address in \"peers\""}},
    {"discovery_servers",
     "schema: 1\ndds: {peers: [hall], security: ., discovery_servers: [a:0, 256@a, 1@2@a, ':80', "
     "'a:65536', x@a, 'a:']}\nlines:\n  - name: a\n    interface: 'simulated:'\n",
     {"plant.yaml:2:54: error: expected a discovery server [ID@]HOST[:PORT], got \"a:0\"",
      "plant.yaml:2:54: error: expected a discovery server [ID@]HOST[:PORT], got \"256@a\"",
      "plant.yaml:2:54: error: expected a discovery server [ID@]HOST[:PORT], got \"1@2@a\"",
      "plant.yaml:2:54: error: expected a discovery server [ID@]HOST[:PORT], got \":80\"",
      "plant.yaml:2:54: error: expected a discovery server [ID@]HOST[:PORT], got \"a:65536\"",
      "plant.yaml:2:54: error: expected a discovery server [ID@]HOST[:PORT], got \"x@a\"",
      "plant.yaml:2:54: error: expected a discovery server [ID@]HOST[:PORT], got \"a:\"",
      "plant.yaml:2:54: error: \"peers\" are for a gateway without \"discovery_servers\": with "
      "them it announces itself to the servers alone",
      "plant.yaml:2:54: error: \"discovery_servers\" are for DDS without security"}},
    {"values",
     "schema: 1\n"
     "gateway: {name: two words, log: loud}\n"
     "dds: {domain: 300}\n"
     "lines:\n"
     "  - name: a\n"
     "    interface: 'simulated:'\n"
     "    bit_rate: 500\n"
     "    node_id: 128\n"
     "    heartbeat: 100\n"
     "    sync: soon\n"
     "    sdo_timeout: 1h\n"
     "    pdo_update_time: 61s\n"
     "    reset_nodes: maybe\n"
     "    access: {commands: write}\n"
     "    publish: on_chang\n"
     "    nodes: 7\n"
     "    request_share: 30\n"
     "    client_share: 101%\n"
     "    sdo_connections: {first: 0x180, last: 0x6E0}\n",
     {"plant.yaml:2:17: error: a name has 1 to 64 letters, digits, '-' and '_', not \"two words\"",
      "plant.yaml:2:33: error: expected trace, debug, info, warning, error or off, got \"loud\"",
      "plant.yaml:3:15: error: expected a number from 0 to 232, got \"300\"",
      "plant.yaml:7:15: error: expected a bit rate such as 500kbit, got \"500\"",
      "plant.yaml:8:14: error: expected a number from 1 to 127, got \"128\"",
      "plant.yaml:9:16: error: the time \"100\" has no unit: write \"100ms\", \"us\", \"s\", "
      "\"min\"",
      "plant.yaml:10:11: error: expected a time such as 100ms, got \"soon\"",
      "plant.yaml:11:18: error: expected a time from 1ms to 600s, got \"1h\"",
      "plant.yaml:12:22: error: expected a time from 0 to 60s, got \"61s\"",
      "plant.yaml:13:18: error: expected true or false, got \"maybe\"",
      "plant.yaml:14:24: error: expected off, read or all, got \"write\"",
      "plant.yaml:15:14: error: expected on_change or on_sync, got \"on_chang\"; did you mean "
      "\"on_change\"?",
      "plant.yaml:16:12: error: nodes is a list, not \"7\"",
      "plant.yaml:17:20: error: expected a share from 1% to 100%, got \"30\"",
      "plant.yaml:18:19: error: expected a share from 1% to 100%, got \"101%\"",
      "plant.yaml:19:30: error: expected a number from 385 to 1759, got \"0x180\"",
      "plant.yaml:19:43: error: expected a number from 385 to 1759, got \"0x6E0\""}},
    {"clients_of_access",
     "schema: 1\ndds: {security: /proc/self}\nlines:\n"
     "  - name: a\n"
     "    interface: 'simulated:'\n"
     "    access:\n"
     "      clients:\n"
     "        anna: all\n"
     "        viewer/office: read\n"
     "        operator/a/b: all\n"
     "        operator/panel3: some\n"
     "        engineer/anna: {commands: all}\n"
     "        engineer/anna: all\n"
     "  - {name: b, interface: 'simulated:', access: {clients: [operator/panel3]}}\n",
     {"plant.yaml:8:9: error: \"anna\" is no client that sends requests: write the role and the "
      "name of "
      "its certificate, such as operator/panel3 or engineer/anna",
      "plant.yaml:9:9: error: \"viewer/office\" is no client that sends requests: write the role "
      "and the "
      "name of its certificate, such as operator/panel3 or engineer/anna",
      "plant.yaml:10:9: error: \"operator/a/b\" is no client that sends requests: write the role "
      "and the "
      "name of its certificate, such as operator/panel3 or engineer/anna",
      "plant.yaml:11:26: error: expected off, read or all, got \"some\"",
      "plant.yaml:12:24: error: the access of engineer/anna needs the key \"outputs\"",
      "plant.yaml:13:9: error: the key \"engineer/anna\" is there twice",
      "plant.yaml:14:58: error: clients is a mapping (\"key: value\"), not a list"}},
    {"clients_without_security",
     "schema: 1\nlines:\n"
     "  - name: a\n"
     "    interface: 'simulated:'\n"
     "    access: {commands: all, clients: {operator/panel3: read}}\n",
     {"plant.yaml:5:38: error: clients of \"access\" need DDS-Security, which proves the name of a "
      "client: dds: {security: FOLDER}"}},
    {"roles",
     "schema: 1\nlines:\n"
     "  - {name: a, interface: 'simulated:', role: device}\n"
     "  - {name: b, interface: 'simulated:', role: slave}\n",
     {"plant.yaml:4:46: error: expected manager, observer or device, got \"slave\""}},
    {"interface",
     "schema: 1\nlines:\n  - {name: a, interface: 'socketcan:'}\n  - {name: b, interface: can0}\n",
     {"plant.yaml:3:26: error: interface \"socketcan:\" needs a name of printable characters after "
      "the colon, as in \"socketcan:can0\"; there is also simulated:",
      "plant.yaml:4:26: error: interface \"can0\" has no scheme: write \"socketcan:can0\" or "
      "\"virtual:can0\"; there is also simulated:"}},
    {"own_objects",
     "schema: 1\nlines:\n"
     "  - name: a\n"
     "    interface: socketcan:can0\n"
     "    own_objects:\n"
     "      5F00: {type: u8}\n"
     "      recipe: {type: u8}\n"
     "      2100:1: {name: x}\n"
     "      2100:2: {type: word}\n"
     "      2100:3: {type: u8, default: 256, access: r}\n"
     "      2100:4: {type: b, image: true}\n"
     "      2100:5: {type: u8, store: true}\n"
     "      2100:6: {type: u8, limit: 3}\n"
     "      2100:07: {type: u8}\n"
     "      2100:7: {type: u8}\n",
     {"plant.yaml:6:7: error: 5F00:00 is not in 2000h..5EFFh or 6000h..9FFFh",
      "plant.yaml:7:7: error: expected an object such as 2100:1 (index and sub-index hexadecimal), "
      "got \"recipe\"",
      "plant.yaml:8:15: error: 2100:01 needs the key \"type\"",
      "plant.yaml:9:22: error: expected b, i8, i16, i24, i32, i40, i48, i56, i64, u8, u16, u24, "
      "u32, "
      "u40, u48, u56, u64, r32, r64, vs or os, got \"word\"",
      "plant.yaml:10:35: error: \"256\" is no UNSIGNED8",
      "plant.yaml:10:48: error: expected ro, wo, rw, rwr, rww or const, got \"r\"; did you "
      "mean \"ro\"?",
      "plant.yaml:11:7: error: 2100:04 is a BOOLEAN, which the image stores as a bit: use "
      "UNSIGNED8",
      "plant.yaml:12:7: error: 2100:05 is to be stored, but the line has no storage",
      "plant.yaml:13:26: error: unknown key \"limit\" in 2100:06",
      "plant.yaml:15:7: error: 2100:07 is there twice"}},
    {"storage",
     "schema: 1\nlines:\n"
     "  - {name: a, interface: socketcan:can0, storage: deploy/demo}\n"
     "  - {name: b, interface: socketcan:can1, storage: ''}\n",
     {"plant.yaml:3:51: error: deploy/demo is no folder",
      "plant.yaml:4:51: error: expected a value, got \"\""}},
    {"record",
     "schema: 1\nlines:\n"
     "  - {name: a, interface: socketcan:can0, record: nowhere/a.log}\n"
     "  - {name: b, interface: socketcan:can1, record: {file: deploy, max_size: 10, files: 0}}\n"
     "  - {name: c, interface: socketcan:can2, record: {max_size: 999B, size: 1}}\n"
     "  - {name: d, interface: socketcan:can3, record: x.log}\n"
     "  - {name: e, interface: socketcan:can4, record: {file: deploy/../x.log}}\n",
     {"plant.yaml:3:50: warning: nothing is recorded until there is a folder nowhere",
      "plant.yaml:4:57: warning: nothing is recorded: deploy is a folder, record needs the name of "
      "a file",
      "plant.yaml:4:75: error: expected a size from 1kB such as 100MB, got \"10\"",
      "plant.yaml:4:86: error: expected a number from 1 to 10000, got \"0\"",
      "plant.yaml:5:50: error: record needs the key \"file\"",
      "plant.yaml:5:61: error: expected a size from 1kB such as 100MB, got \"999B\"",
      "plant.yaml:5:67: error: unknown key \"size\" in record",
      "plant.yaml:7:57: error: recorded to the same file x.log as line \"d\""}},
    {"journal",
     "schema: 1\njournal: {file: nowhere/j.db, max_size: 9MB, max_age: 1s, path: x}\n"
     "lines: [{name: a, interface: socketcan:can0}]\n",
     {"plant.yaml:2:17: warning: no event is stored until there is a folder nowhere",
      "plant.yaml:2:41: error: expected a size from 10MB such as 100MB, got \"9MB\"",
      "plant.yaml:2:55: error: expected an age from 1min such as 90d or 36h, got \"1s\"",
      "plant.yaml:2:59: error: unknown key \"path\" in journal"}},
    {"history",
     "schema: 1\njournal: {file: deploy/j.db, values_size: 900kB}\nlines:\n"
     "  - name: a\n"
     "    interface: socketcan:can0\n"
     "    nodes: [{id: 5, name: ram, eds: bridges/sim/eds/drive.eds}]\n"
     "    history: {entries: [ram.Statuswort, ram.6041, [x]], min_interval: 10ms, every: 1s}\n",
     {"plant.yaml:2:43: error: expected a size from 1MB such as 100MB, got \"900kB\"",
      "plant.yaml:7:51: error: expected the name of an entry of the process image",
      "plant.yaml:7:71: error: expected a time from 100ms to 86400s, got \"10ms\"",
      "plant.yaml:7:77: error: unknown key \"every\" in history"}},
    {"history_of_no_entry",
     "schema: 1\njournal: {file: deploy/j.db}\nlines:\n"
     "  - name: a\n"
     "    interface: socketcan:can0\n"
     "    nodes: [{id: 5, name: ram, eds: bridges/sim/eds/drive.eds}]\n"
     "    history: [ram.Statuswort, ram.6041, lamp.*]\n",
     {"plant.yaml:7:15: error: there is no input and no output \"ram.Statuswort\"; did you mean "
      "\"ram.Statusword\"?",
      "plant.yaml:7:41: error: there is no input and no output \"lamp.*\""}},
    {"history_without_a_journal",
     "schema: 1\nlines:\n  - {name: a, interface: socketcan:can0, history: [ram.Statusword]}\n",
     {"plant.yaml:3:51: error: history needs the journal that stores it: journal: {file: ...}"}},
    {"named",
     "schema: 1\nlines:\n  - name: a\n    interface: socketcan:can0\n"
     "    nodes: [{id: 5, name: ram, eds: bridges/sim/eds/drive.eds}]\n"
     "    named: {aliases: {ram.6041: long, ram.Statuswort: State, ram.6064: [x]}, topics: 1}\n",
     {"plant.yaml:6:33: error: \"long\" is no identifier: letters, digits and single underscores "
      "between them, beginning with a letter, no reserved word, up to 128 characters; did you mean "
      "\"long_\"?",
      "plant.yaml:6:72: error: expected a value, got a list",
      "plant.yaml:6:78: error: unknown key \"topics\" in named"}},
    {"written_by_name",
     "schema: 1\n"
     "lines:\n"
     "  - name: a\n"
     "    interface: 'simulated:'\n"
     "    nodes: [{id: 5, name: ram, eds: bridges/sim/eds/drive.eds}]\n"
     "    outputs:\n"
     "      groups:\n"
     "        - {name: one, entries: [ram.6040], written_by: name}\n",
     {"plant.yaml:8:56: error: expected output_write or named, got \"name\"; did you mean "
      "\"named\"?"}},
    {"written_by_name_without_outputs",
     "schema: 1\n"
     "lines:\n"
     "  - name: a\n"
     "    interface: 'simulated:'\n"
     "    nodes: [{id: 5, name: ram, eds: bridges/sim/eds/drive.eds}]\n"
     "    outputs:\n"
     "      groups:\n"
     "        - {name: one, entries: [], written_by: named}\n",
     {"plant.yaml:8:11: error: group one has no named topic: it has no outputs"}},
    {"written_by_name_of_an_observer",
     "schema: 1\n"
     "lines:\n"
     "  - name: a\n"
     "    interface: socketcan:can0\n"
     "    role: observer\n"
     "    nodes: [{id: 5, name: ram, eds: bridges/sim/eds/drive.eds}]\n"
     "    outputs:\n"
     "      groups:\n"
     "        - {name: one, entries: [ram.6040], written_by: named}\n",
     {"plant.yaml:8:7: warning: outputs has no effect on an observer, which transmits nothing",
      "plant.yaml:9:11: error: written_by: a line in the role observer has no outputs to write"}},
    {"written_by_name_with_a_collision",
     "schema: 1\n"
     "lines:\n"
     "  - name: a\n"
     "    interface: 'simulated:'\n"
     "    nodes:\n"
     "      - {id: 5, name: a-b, eds: bridges/sim/eds/drive.eds}\n"
     "      - {id: 6, name: a_b, eds: bridges/sim/eds/drive.eds}\n"
     "    outputs:\n"
     "      groups:\n"
     "        - {name: one, entries: [a-b.6040, a_b.6040], written_by: named}\n",
     {"plant.yaml:10:11: error: group one has no named topic: \"a_b.Controlword\" and "
      "\"a-b.Controlword\" make the same identifier a_b_Controlword: give one of them an alias"}},
    {"named_entry",
     "schema: 1\nlines:\n  - name: a\n    interface: socketcan:can0\n"
     "    nodes: [{id: 5, name: ram, eds: bridges/sim/eds/drive.eds}]\n"
     "    named: {aliases: {ram.Statuswort: State}}\n",
     {"plant.yaml:6:23: error: there is no input and no output \"ram.Statuswort\"; did you mean "
      "\"ram.Statusword\"?"}},
    {"named_collision",
     "schema: 1\nlines:\n  - name: a\n    interface: socketcan:can0\n"
     "    nodes: [{id: 5, name: ram, eds: bridges/sim/eds/drive.eds}]\n"
     "    named: {aliases: {ram.6041: statusWORD, ram.6064: Statusword}}\n",
     {"plant.yaml:6:12: error: inputs of line a: \"ram.Position actual value\" and "
      "\"ram.Statusword\" make the same identifier Statusword: give one of them an alias"}},
    {"ros2_collision",
     "schema: 1\nlines:\n  - name: a\n    interface: socketcan:can0\n"
     "    nodes:\n"
     "      - {id: 5, name: a-b, eds: bridges/sim/eds/encoder.eds}\n"
     "      - {id: 6, name: a_b, eds: bridges/sim/eds/encoder.eds}\n"
     "    named: {ros2: true}\n",
     {"plant.yaml:8:19: error: inputs of line a, device a_b: another device has the topic "
      "rt/plant/a/a_b/inputs of ROS 2, too: give it another name"}},
    {"ros2_lines",
     "schema: 1\nlines:\n"
     "  - {name: a-b, interface: 'virtual:a', node_id: 1, named: {ros2: true}}\n"
     "  - {name: a_b, interface: 'virtual:b', node_id: 1, named: {ros2: true}}\n",
     {"plant.yaml:4:67: error: line \"a-b\" has the same name in ROS 2: a_b"}},
    {"ros2_with_security",
     "schema: 1\ndds: {security: deploy}\nlines:\n"
     "  - {name: a, interface: 'virtual:a', named: {ros2: true}}\n",
     {"plant.yaml:4:53: error: \"ros2\" is for DDS without security: the permissions of "
      "identities have no topics of ROS 2"}},
    {"journal_without_a_file",
     "schema: 1\njournal: {file: deploy}\nlines: [{name: a, interface: socketcan:can0}]\n",
     {"plant.yaml:2:17: error: journal needs the name of a file, not \"deploy\", such as "
      "/var/lib/linegate/journal.db"}},
    {"replay",
     "schema: 1\nlines:\n"
     "  - {name: a, interface: 'replay:nowhere.log'}\n"
     "  - {name: b, interface: 'replay:x.log?speed=0'}\n",
     {"plant.yaml:3:26: error: nowhere.log cannot be replayed",
      "plant.yaml:4:26: error: speed of a replay is max or a number from 0.1 to 1000, not \"0\"; "
      "there is also simulated:",
      "nowhere.log: error: the log cannot be read: No such file or directory"}},
    {"lines_that_collide",
     "schema: 1\nlines:\n"
     "  - {name: a, interface: socketcan:can0, network_id: 1}\n"
     "  - {name: a, interface: socketcan:can0, network_id: 1, executor: fast}\n",
     {"plant.yaml:4:12: error: another line is called \"a\"",
      "plant.yaml:4:26: error: the same interface socketcan:can0 as line \"a\"",
      "plant.yaml:4:54: error: the same network_id 1 as line \"a\"",
      "plant.yaml:4:67: error: there is no executor \"fast\" in executors"}},
    {"nodes",
     "schema: 1\n"
     "lines:\n"
     "  - name: a\n"
     "    interface: socketcan:can0\n"
     "    node_id: 7\n"
     "    nodes:\n"
     "      - {id: 5, name: x, eds: nowhere.eds}\n"
     "      - {id: 5, name: x, eds: bridges/sim/eds/drive.eds}\n"
     "      - {id: 7, eds: bridges/sim/eds/drive.eds, heartbeat: {producer: 1s, consumer: 500ms}}\n"
     "      - {id: 9, eds: bridges/sim/eds/drive.eds, heartbeat: 1s, guarding: {time: 1s}}\n"
     "      - {name: y}\n"
     "    simulate: [{node: 5, profile: drive}]\n",
     {"plant.yaml:7:31: error: there is no file nowhere.eds",
      "plant.yaml:8:9: error: node-ID 5 is that of \"x\" already",
      "plant.yaml:8:9: error: another node is called \"x\"",
      "plant.yaml:9:9: error: node-ID 7 is the line's own node_id",
      "plant.yaml:9:60: error: the consumer time 500ms must be longer than the producer time 1s",
      "plant.yaml:10:74: error: guarding needs the key \"factor\"",
      "plant.yaml:10:74: error: a node has either the key \"heartbeat\" or the key \"guarding\"",
      "plant.yaml:11:9: error: a node needs the key \"id\"",
      "plant.yaml:11:9: error: a node needs the key \"eds\" (or \"dcf\")",
      "plant.yaml:12:15: error: simulate needs the interface simulated:; for socketcan:can0 run "
      "the command: linegate simulate socketcan:can0 --device drive:5"}},
    {"objects",
     "schema: 1\n"
     "lines:\n"
     "  - name: a\n"
     "    interface: 'simulated:'\n"
     "    nodes:\n"
     "      - id: 5\n"
     "        eds: bridges/sim/eds/drive.eds\n"
     "        objects:\n"
     "          6083: -1\n"
     "          6041: 1\n"
     "          5000:1: 1\n"
     "          speed: 1\n"
     "          6060: 1\n"
     "          6060:0: 2\n",
     {"plant.yaml:9:17: error: \"-1\" is no UNSIGNED32 for object 6083:00 (Profile acceleration)",
      "plant.yaml:10:11: error: object 6041:00 (Statusword) cannot be written: its access is "
      "read-only",
      "plant.yaml:11:11: error: bridges/sim/eds/drive.eds has no object 5000:01",
      "plant.yaml:12:11: error: expected an object such as 6083:1 (index and sub-index "
      "hexadecimal), got \"speed\"",
      "plant.yaml:14:11: error: object 6060:00 is there twice"}},
    {"pdos",
     "schema: 1\n"
     "lines:\n"
     "  - name: a\n"
     "    interface: 'simulated:'\n"
     "    nodes:\n"
     "      - id: 5\n"
     "        eds: bridges/sim/eds/drive.eds\n"
     "        pdos:\n"
     "          pdo1: {}\n"
     "          tpdo9: {type: sync}\n"
     "          tpdo1: {type: snyc, cob_id: 0x701, inhibit: 150us, map: [6040, 6083:1, six]}\n"
     "          rpdo1: {type: 245, map: [6041, 607A, 60FF, 6040], event: 1}\n",
     {"plant.yaml:9:11: error: expected tpdo1 to tpdo512 or rpdo1 to rpdo512, got \"pdo1\"",
      "plant.yaml:10:11: error: bridges/sim/eds/drive.eds has no object 1808:01",
      "plant.yaml:11:25: error: expected sync, sync_acyclic or event, got \"snyc\"; did you "
      "mean "
      "\"sync\"?",
      "plant.yaml:11:39: error: the identifier 0x701 is reserved for another service (CiA 301, "
      "7.3.5)",
      "plant.yaml:11:55: error: expected a multiple of 100us, got \"150us\"",
      "plant.yaml:11:68: error: object 6040:00 (Controlword) cannot be mapped into a TPDO",
      "plant.yaml:11:74: error: bridges/sim/eds/drive.eds has no object 6083:01",
      "plant.yaml:11:82: error: expected an object such as 6000:1, got \"six\"",
      "plant.yaml:12:25: error: transmission types 241 to 251 are reserved (CiA 301)",
      "plant.yaml:12:35: error: the objects have 80 bits; a PDO has room for 64",
      "plant.yaml:12:36: error: object 6041:00 (Statusword) cannot be mapped into an RPDO",
      "plant.yaml:12:61: error: unknown key \"event\" in rpdo1"}},
    {"outputs",
     "schema: 1\n"
     "lines:\n"
     "  - name: a\n"
     "    interface: 'simulated:'\n"
     "    nodes:\n"
     "      - {id: 5, name: ram, eds: bridges/sim/eds/drive.eds}\n"
     "    outputs:\n"
     "      groups:\n"
     "        - {name: one, number: 3, entries: [ram.Controlwrd, ram.6040]}\n"
     "        - {name: two, number: 3, entries: [ram.Controlword, ram.6041]}\n"
     "      defaults:\n"
     "        ram.6060: 300\n"
     "        ram.9999: 1\n",
     {"plant.yaml:9:44: error: there is no output \"ram.Controlwrd\"; did you mean "
      "\"ram.Controlword\"?",
      "plant.yaml:10:11: error: group \"two\" has the number of another",
      "plant.yaml:10:44: error: the output \"ram.Controlword\" is in group \"one\" already",
      "plant.yaml:10:61: error: there is no output \"ram.6041\"",
      "plant.yaml:12:19: error: \"300\" is no INTEGER8 for \"ram.Modes of operation\"",
      "plant.yaml:13:9: error: there is no output \"ram.9999\""}},
    {"auto",
     "schema: 1\n"
     "lines:\n"
     "  - name: a\n"
     "    interface: 'simulated:'\n"
     "    auto: {eds: nowhere, heartbeat: 0.5ms, setup: true}\n"
     "  - name: b\n"
     "    interface: 'simulated:'\n"
     "    auto: true\n"
     "    nodes: [{id: 5, eds: bridges/sim/eds/drive.eds}]\n"
     "  - {name: c, interface: 'simulated:', role: observer, auto: true}\n",
     {"plant.yaml:5:17: error: there is no folder nowhere",
      "plant.yaml:5:37: error: expected a multiple of 1ms, got \"0.5ms\"",
      "plant.yaml:5:44: error: unknown key \"setup\" in auto; did you mean \"set_up\"?",
      "plant.yaml:8:11: error: auto is for a line in the role manager without nodes: a scan finds "
      "them",
      "plant.yaml:10:62: error: auto is for a line in the role manager without nodes: a scan finds "
      "them"}},
};

INSTANTIATE_TEST_SUITE_P(Config, BadPlant, testing::ValuesIn(kBad),
                         [](const auto& which) { return std::string(which.param.name); });

TEST(Plant, CannotBeReadIfThereIsNone) {
  const auto loaded = load(kRoot + "nothing/here.yaml");
  EXPECT_EQ(messages(loaded), std::vector<std::string>{"nothing/here.yaml: error: cannot be read"});
}

TEST(Plant, TellsErrorsOfADeviceFileWithTheirPlaceInIt) {
  const auto loaded = read(
      "schema: 1\nlines:\n  - {name: a, interface: 'simulated:', nodes: [{id: 5, eds: bad.eds}]}\n",
      kRoot + "tests/gateway/config/plant.yaml");
  const auto told = messages(loaded);
  ASSERT_GE(told.size(), 2U);
  EXPECT_EQ(told.front(),
            "tests/gateway/config/plant.yaml:3:61: error: the device file "
            "tests/gateway/config/bad.eds has errors");
  EXPECT_TRUE(std::any_of(told.begin(), told.end(), [](const std::string& text) {
    return text.starts_with("tests/gateway/config/bad.eds:654:");
  })) << testing::PrintToString(told);
}

TEST(Plant, RecordHasDefaults) {
  const auto loaded = read_text(
      "schema: 1\nlines:\n"
      "  - {name: a, interface: socketcan:can0, record: deploy/a.log}\n"
      "  - {name: b, interface: socketcan:can1, record: {file: b.log, max_size: 1.5GB, files: 2}}\n"
      "  - {name: c, interface: socketcan:can2}\n");
  ASSERT_TRUE(loaded.ok()) << testing::PrintToString(messages(loaded));
  const auto& lines = loaded.value->lines;
  ASSERT_TRUE(lines[0].record && lines[1].record);
  EXPECT_TRUE(lines[0].record->file.ends_with("deploy/a.log")) << lines[0].record->file;
  EXPECT_EQ(lines[0].record->max_size, 100'000'000U);
  EXPECT_EQ(lines[0].record->files, 10U);
  EXPECT_EQ(lines[1].record->max_size, 1'500'000'000U);
  EXPECT_EQ(lines[1].record->files, 2U);
  EXPECT_FALSE(lines[2].record);
}

TEST(Plant, AJournalHasDefaults) {
  const auto journal = [](const std::string& keys) {
    return read_text("schema: 1\n" + keys + "lines: [{name: a, interface: 'socketcan:can0'}]\n");
  };
  EXPECT_FALSE(journal("").value->journal);
  const auto plain = journal("journal: {file: deploy/j.db}\n");
  ASSERT_TRUE(plain.value && plain.value->journal) << testing::PrintToString(messages(plain));
  EXPECT_TRUE(plain.value->journal->file.ends_with("deploy/j.db"));
  EXPECT_EQ(plain.value->journal->max_size, 250'000'000U);
  EXPECT_EQ(plain.value->journal->max_age, Duration::zero());
  EXPECT_EQ(plain.value->journal->values_size, 50'000'000U);
  const auto full = journal("journal: {file: deploy/j.db, max_size: 10MB, max_age: 90d}\n");
  ASSERT_TRUE(full.value && full.value->journal) << testing::PrintToString(messages(full));
  EXPECT_EQ(full.value->journal->max_size, 10'000'000U);
  EXPECT_EQ(full.value->journal->max_age, std::chrono::hours(90 * 24));
}

TEST(Plant, AHistoryNamesInputsAndOutputs) {
  const auto history = [](const std::string& keys) {
    return read_text(
        "schema: 1\njournal: {file: deploy/j.db, values_size: 2MB}\nlines:\n"
        "  - name: a\n    interface: 'socketcan:can0'\n"
        "    nodes: [{id: 5, name: ram, eds: bridges/sim/eds/drive.eds}]\n    history: " +
        keys + "\n");
  };
  const auto plain = history("[ram.6041, ram.Controlword, ram.Statusword]");
  ASSERT_TRUE(plain.ok()) << testing::PrintToString(messages(plain));
  EXPECT_EQ(plain.value->journal->values_size, 2'000'000U);
  const History& found = plain.value->lines.at(0).history;
  EXPECT_EQ(found.entries,
            (std::vector<History::Entry>{{image::Direction::inputs, 5, "ram.Statusword"},
                                         {image::Direction::outputs, 5, "ram.Controlword"}}));
  EXPECT_EQ(found.min_interval, 1s);
  const auto full = history("{entries: ['ram.*'], min_interval: 5s}");
  ASSERT_TRUE(full.ok()) << testing::PrintToString(messages(full));
  EXPECT_GT(full.value->lines.at(0).history.entries.size(), 2U);
  EXPECT_EQ(full.value->lines.at(0).history.min_interval, 5s);
}

TEST(Plant, ACertificateHasAnAccessOfItsOwn) {
  const auto plant = read_text(
      "schema: 1\ndds: {security: /proc/self}\nlines:\n  - name: a\n    interface: 'simulated:'\n"
      "    access:\n      outputs: off\n      clients:\n        operator/panel.3: all\n"
      "        engineer/anna: {commands: all, outputs: off}\n");
  ASSERT_TRUE(plant.value) << testing::PrintToString(messages(plant));
  const LinePlan& line = plant.value->lines.at(0);
  EXPECT_EQ(line.commands, Access::read);
  EXPECT_EQ(line.outputs, Access::off);
  ASSERT_EQ(line.clients.size(), 2U);
  EXPECT_EQ(line.clients.at("operator/panel.3").commands, Access::all);
  EXPECT_EQ(line.clients.at("operator/panel.3").outputs, Access::all);
  EXPECT_EQ(line.clients.at("engineer/anna").commands, Access::all);
  EXPECT_EQ(line.clients.at("engineer/anna").outputs, Access::off);
}

TEST(Plant, PartitionsOfLinesAreForDdsWithoutSecurity) {
  const auto partitions = [](const std::string& dds) {
    return read_text("schema: 1\n" + dds + "lines: [{name: a, interface: 'socketcan:can0'}]\n");
  };
  EXPECT_FALSE(partitions("").value->dds_partitions);
  EXPECT_TRUE(partitions("dds: {partitions: true}\n").value->dds_partitions);
  EXPECT_FALSE(
      partitions("dds: {partitions: false, security: /proc/self}\n").value->dds_partitions);
  EXPECT_EQ(messages(partitions("dds: {partitions: true, security: /proc/self}\n")),
            std::vector<std::string>{"plant.yaml:2:19: error: \"partitions\" is for DDS without "
                                     "security: the permissions of a "
                                     "gateway allow it to publish in the default partition alone"});
}

TEST(Plant, ImagesByMulticastNeedTheGuardAndDdsWithoutSecurity) {
  const auto fan_out = [](const std::string& dds) {
    return read_text("schema: 1\n" + dds + "lines: [{name: a, interface: 'socketcan:can0'}]\n");
  };
  EXPECT_FALSE(fan_out("").value->dds_multicast);
  EXPECT_FALSE(fan_out("dds: {fan_out: unicast, guard: off}\n").value->dds_multicast);
  EXPECT_TRUE(fan_out("dds: {fan_out: multicast}\n").value->dds_multicast);
  EXPECT_TRUE(fan_out("dds: {fan_out: multicast, process: own}\n").value->dds_multicast);
  EXPECT_EQ(messages(fan_out("dds: {fan_out: multicast, security: /proc/self}\n")),
            std::vector<std::string>{
                "plant.yaml:2:16: error: \"fan_out: multicast\" is for DDS without security: the "
                "guard cannot check encrypted announcements of readers, and those can end the "
                "gateway"});
  EXPECT_EQ(messages(fan_out("dds: {fan_out: multicast, discovery_servers: [a]}\n")),
            std::vector<std::string>{
                "plant.yaml:2:16: error: \"fan_out: multicast\" is not for \"discovery_servers\", "
                "which are for networks without multicast"});
  EXPECT_EQ(messages(fan_out("dds: {guard: off, fan_out: multicast}\n")),
            std::vector<std::string>{
                "plant.yaml:2:28: error: \"fan_out: multicast\" needs \"guard: on\": announcements "
                "of readers that nobody checks can end the gateway"});
}

TEST(Plant, TheDdsGuardIsOnUnlessSwitchedOff) {
  const auto guard = [](const std::string& dds) {
    return read_text("schema: 1\n" + dds + "lines: [{name: a, interface: 'socketcan:can0'}]\n");
  };
  EXPECT_TRUE(guard("").value->dds_guard);
  EXPECT_TRUE(guard("dds: {guard: on}\n").value->dds_guard);
  EXPECT_FALSE(guard("dds: {guard: off}\n").value->dds_guard);
  EXPECT_FALSE(guard("dds: {guard: sometimes}\n").ok());
  EXPECT_TRUE(guard("").value->dds_own_process);
  EXPECT_FALSE(guard("dds: {process: same}\n").value->dds_own_process);
  EXPECT_TRUE(guard("dds: {process: own}\n").value->dds_own_process);
  EXPECT_TRUE(guard("dds: {security: .}\n").value->dds_own_process);
  EXPECT_FALSE(guard("dds: {security: ., process: same}\n").value->dds_own_process);
  EXPECT_FALSE(guard("dds: {process: another}\n").ok());
}

TEST(Plant, TheMemoryOfTheDdsProcessHasBounds) {
  const auto memory = [](const std::string& dds) {
    return read_text("schema: 1\n" + dds + "lines: [{name: a, interface: 'socketcan:can0'}]\n");
  };
  EXPECT_EQ(memory("dds: {process: own, memory: 100MB}\n").value->dds_memory, kLeastDdsMemory);
  EXPECT_EQ(memory("dds: {process: own, memory: 2GB}\n").value->dds_memory, kMostDdsMemory);
  EXPECT_FALSE(memory("dds: {process: own, memory: 99MB}\n").ok());
  EXPECT_FALSE(memory("dds: {process: own, memory: 2001MB}\n").ok());
  EXPECT_FALSE(memory("dds: {process: own, memory: much}\n").ok());
}

TEST(Plant, TheFolderOfDdsSecurityExists) {
  const auto security = [](const std::string& dds) {
    return read_text("schema: 1\n" + dds + "lines: [{name: a, interface: 'socketcan:can0'}]\n");
  };
  EXPECT_EQ(security("").value->dds_security, "");
  EXPECT_EQ(security("dds: {security: /proc/self}\n").value->dds_security, "/proc/self");
  EXPECT_EQ(
      security("dds: {security: /proc/self, routes_security: /proc}\n").value->dds_routes_security,
      "/proc");
  EXPECT_FALSE(security("dds: {security: /proc/self, routes_security: nowhere}\n").ok());
  EXPECT_EQ(messages(security("dds: {routes_security: /proc/self}\n")),
            (std::vector<std::string>{
                "plant.yaml:2:24: error: \"routes_security\" is for DDS with security: the gateway "
                "needs an identity of its own, too"}));
  const auto missing = security("dds: {security: nowhere}\n");
  EXPECT_FALSE(missing.ok());
  EXPECT_NE(testing::PrintToString(messages(missing)).find("there is no folder "),
            std::string::npos);
}

TEST(Plant, HasDefaults) {
  const auto loaded = read_text("schema: 1\nlines: [{name: a, interface: 'socketcan:can0'}]\n");
  ASSERT_TRUE(loaded.ok()) << testing::PrintToString(messages(loaded));
  EXPECT_EQ(loaded.value->gateway, "linegate");
  EXPECT_EQ(loaded.value->dds_domain, 0U);
  EXPECT_EQ(loaded.value->log, LogLevel::info);
  ASSERT_EQ(loaded.value->lines.size(), 1U);
  const LinePlan& line = loaded.value->lines.front();
  EXPECT_EQ(line.commands, Access::read);
  EXPECT_EQ(line.outputs, Access::read);
  EXPECT_EQ(line.interface.scheme, Scheme::socketcan);
  EXPECT_EQ(line.interface.name, "can0");
  EXPECT_EQ(line.publish.rule, Publish::Rule::on_change);
  EXPECT_EQ(line.publish.time, 10ms);
  EXPECT_EQ(line.pdo_min_period, 100ms);
  EXPECT_EQ(line.config.node_id, 127);
  EXPECT_EQ(line.config.network_id, 1);
  EXPECT_EQ(line.config.sync_period, 0ns);
}

TEST(Plant, AnObserverNeedsNoNodeIdAndTellsWhatItIgnores) {
  const auto loaded = read_text(R"(schema: 1
lines:
  - name: press
    interface: "simulated:"
    role: observer
    sync: 10ms
    heartbeat: 500ms
    storage: var/parameters
  - {name: hall, interface: "simulated:", role: observer, node_id: 126}
)");
  ASSERT_TRUE(loaded.ok()) << testing::PrintToString(messages(loaded));
  EXPECT_EQ(messages(loaded),
            (std::vector<std::string>{
                "plant.yaml:7:16: warning: heartbeat has no effect on an observer, which transmits "
                "nothing",
                "plant.yaml:8:14: warning: storage has no effect on an observer, which transmits "
                "nothing"}));
  const Plant& plant = *loaded.value;
  EXPECT_EQ(plant.lines.at(0).config.role, line::Role::observer);
  EXPECT_EQ(plant.lines.at(0).config.node_id, 0);
  EXPECT_TRUE(plant.lines.at(0).storage.empty());
  EXPECT_EQ(plant.lines.at(1).config.node_id, 126) << "the default node-ID of a master";
}

TEST(Plant, ALineMayBeConfiguredByWhatIsOnIt) {
  const auto loaded = read_text(R"(schema: 1
lines:
  - {name: a, interface: "simulated:", auto: true}
  - name: b
    interface: "simulated:"
    auto: {at_start: false, set_up: true, heartbeat: 250ms, eds: bridges/sim/eds}
  - {name: c, interface: "simulated:", auto: false}
)");
  ASSERT_TRUE(loaded.ok()) << testing::PrintToString(messages(loaded));
  const std::vector<LinePlan>& lines = loaded.value->lines;
  ASSERT_TRUE(lines[0].auto_scan);
  EXPECT_TRUE(lines[0].auto_scan->at_start);
  EXPECT_FALSE(lines[0].auto_scan->set_up) << "nothing is written unless set_up is requested";
  EXPECT_EQ(lines[0].config.found_heartbeat, 500ms);
  ASSERT_TRUE(lines[1].auto_scan);
  EXPECT_FALSE(lines[1].auto_scan->at_start);
  EXPECT_TRUE(lines[1].auto_scan->set_up);
  EXPECT_EQ(lines[1].auto_scan->eds, kRoot + "bridges/sim/eds");
  EXPECT_EQ(lines[1].config.found_heartbeat, 250ms);
  EXPECT_FALSE(lines[2].auto_scan);
}

TEST(Plant, ALineMayBeOfCanopenFd) {
  const auto loaded = read_text(R"(schema: 1
lines:
  - name: a
    interface: "simulated:"
    bit_rate: 1Mbit
    canopen_fd: true
    data_bit_rate: 5Mbit
    usdo_abort: four-bytes
    emcy_fd: true
    simulate: [{node: 5, profile: fd-io}]
    nodes: [{id: 5, name: io, eds: bridges/sim/eds/fd-io.eds, heartbeat: 200ms}]
  - {name: b, interface: "simulated:"}
)");
  ASSERT_TRUE(loaded.ok()) << testing::PrintToString(messages(loaded));
  const LinePlan& line = loaded.value->lines[0];
  EXPECT_TRUE(line.config.canopen_fd);
  EXPECT_EQ(line.config.data_bit_rate, 5'000'000U);
  EXPECT_EQ(line.config.usdo_abort, usdo::AbortForm::four_bytes);
  EXPECT_TRUE(line.simulated[0].fd);
  EXPECT_TRUE(line.config.emcy_fd);
  EXPECT_TRUE(line.simulated[0].emcy_fd);
  EXPECT_FALSE(loaded.value->lines[1].config.canopen_fd);
  EXPECT_EQ(loaded.value->lines[1].config.usdo_abort, usdo::AbortForm::one_byte);
}

TEST(Plant, PdosOfCanopenFdHaveRoomFor64Bytes) {
  const auto loaded = read_text(R"(schema: 1
lines:
  - name: a
    interface: "simulated:"
    canopen_fd: true
    nodes:
      - id: 5
        eds: bridges/sim/eds/fd-io.eds
        pdos:
          tpdo1: {map: ["6000:1", "6000:2", "6000:3", "6000:4", "6000:5", "6000:6", "6000:7", "6000:8", "6000:9"]}
)");
  ASSERT_TRUE(loaded.ok()) << testing::PrintToString(messages(loaded));
}

TEST(Plant, WhatCanopenFdDoesNotHaveIsRefused) {
  const auto refused = [](const std::string& line) {
    const auto loaded =
        read_text("schema: 1\nlines: [{name: a, interface: 'simulated:', " + line + "}]\n");
    EXPECT_FALSE(loaded.ok()) << line;
    return testing::PrintToString(messages(loaded));
  };
  EXPECT_THAT(refused("data_bit_rate: 5Mbit"),
              testing::HasSubstr("data_bit_rate needs canopen_fd: true"));
  EXPECT_THAT(refused("canopen_fd: true, data_bit_rate: fast"),
              testing::HasSubstr("expected a bit rate such as 5Mbit, got"));
  EXPECT_THAT(refused("canopen_fd: true, nodes: [{id: 5, eds: bridges/sim/eds/fd-io.eds, guarding: "
                      "{time: 100ms, factor: 3}}]"),
              testing::HasSubstr("CANopen FD has no node guarding"));
}

TEST(Plant, LinesOfCanopenFdHaveEachRole) {
  for (const std::string role : {"manager", "observer", "device, node_id: 3"}) {
    const auto loaded = read_text(
        "schema: 1\nlines: [{name: a, interface: 'simulated:', canopen_fd: true, role: " + role +
        "}]\n");
    EXPECT_TRUE(loaded.ok()) << role << testing::PrintToString(messages(loaded));
  }
}

TEST(Plant, DiscoveryServersHaveDifferentIds) {
  EXPECT_EQ(messages(read("schema: 1\ndds: {discovery_servers: [1@a, b, 2@c, d]}\n"
                          "lines: [{name: a, interface: 'simulated:'}]\n",
                          "plant.yaml")),
            std::vector<std::string>{"plant.yaml:2:26: error: two discovery servers have the ID 1: "
                                     "without ID@ it is the position in the list, from 0"});
}

TEST(Plant, ReadsDiscoveryServers) {
  const Plant plant = *read(
                           "schema: 1\ndds: {discovery_servers: [10.0.0.9, '7@hall.plant:11888']}\n"
                           "lines: [{name: a, interface: 'simulated:'}]\n",
                           "plant.yaml")
                           .value;
  EXPECT_THAT(plant.dds_servers, ElementsAre("10.0.0.9", "7@hall.plant:11888"));
}

constexpr const char* kEveryKeyOfALine = R"(schema: 1
gateway: {name: hall-7, log: debug}
dds: {domain: 42, participants: 250, fan_out: multicast, interfaces: [eth0, 10.0.0.1], peers: [hall-b.plant, 192.168.7.3]}
executors: [{name: fast, priority: 50, processor: 1, lock_memory: true}]
lines:
  - name: press
    interface: "simulated:"
    bit_rate: 250kbit
    network_id: 9
    role: manager
    node_id: 1
    heartbeat: 500ms
    sync: 2.5ms
    time: 1s
    sdo_timeout: 300ms
    pdo_update_time: 20ms
    save_timeout: 20s
    load_timeout: 5s
    strict_ixxat: true
    keep_operational: true
    canopenia_base: 0x5F60
    emcy_bytes: temporary_and_sticky
    reset_nodes: false
    start_nodes: false
    startup: {start_all: true, own_start: false, on_error: stop_all, boot_time: 30s, nmt_inhibit: 2ms}
    flying_master: {priority: 1, master_timeout: 150ms, negotiation_delay: 400ms, priority_slot: 2s, device_slot: 8ms, detect_cycle: 6s, master_heartbeat: 3s, detection: force}
    identity: {vendor: 0x1234, serial: 7}
    own_objects:
      2100:1: {name: Recipe, type: u16, access: rww, default: 5, low: 1, high: 100, map: true, store: true, image: true}
      6100: {type: r32, access: ro}
    own_values: {1007: 2000}
    access: {commands: all, outputs: off}
    publish: {period: 20ms}
    request_share: 40%
    client_share: 10%
    sdo_connections: {first: 0x690, last: 0x6AF}
    pdo_update: {min_period: 1s}
    executor: fast
    storage: var/parameters
    named: {min_separation: 50ms, aliases: {ram.6041: State, "ram.6040:0": Control}}
    simulate: [{node: 5, profile: drive}]
    nodes:
      - id: 5
        name: ram
        eds: bridges/sim/eds/drive.eds
        mandatory: true
        check_identity: false
        serial: 77
        heartbeat: {producer: 200ms, consumer: 700ms}
        boot_timeout: 3s
        keep_alive: true
        reset_time: 4s
        sdo_timeout: 2s
        sdo: {block: never}
        objects: {6083: 1000}
      - {id: 6, eds: bridges/sim/eds/drive.eds, guarding: {time: 100ms, factor: 3}}
    outputs:
      groups:
        - {name: motion, number: 4, send: always, entries: [ram.Controlword, "ram.6060:0"]}
        - {name: targets, number: 5, written_by: named, entries: [ram.607A]}
      defaults: {ram.6060: -1}
)";

void expect_keys_of_the_gateway(const Plant& plant) {
  EXPECT_EQ(plant.gateway, "hall-7");
  EXPECT_EQ(plant.dds_domain, 42U);
  EXPECT_EQ(plant.dds_participants, 250U);
  EXPECT_THAT(plant.dds_interfaces, ElementsAre("eth0", "10.0.0.1"));
  EXPECT_THAT(plant.dds_peers, ElementsAre("hall-b.plant", "192.168.7.3"));
  EXPECT_TRUE(plant.dds_multicast);
  ASSERT_EQ(plant.executors.size(), 1U);
  EXPECT_EQ(plant.executors[0].priority, 50);
  EXPECT_EQ(plant.executors[0].processor, 1U);
  EXPECT_TRUE(plant.executors[0].lock_memory);
}

void expect_keys_of_the_manager(const LinePlan& line) {
  EXPECT_EQ(line.config.bit_rate, 250'000U);
  EXPECT_EQ(line.config.network_id, 9);
  EXPECT_EQ(line.config.node_id, 1);
  EXPECT_EQ(line.config.heartbeat, 500ms);
  EXPECT_EQ(line.config.sync_period, 2500us);
  EXPECT_EQ(line.config.time_period, 1s);
  EXPECT_EQ(line.config.sdo_timeout, 300ms);
  EXPECT_EQ(line.config.pdo_update_time, 20ms);
  EXPECT_EQ(line.config.request_share, 400);
  EXPECT_EQ(line.config.client_share, 100);
  EXPECT_EQ(line.config.connection_pool, (manager::ConnectionPool{0x690, 0x6AF}));
  EXPECT_EQ(line.config.save_timeout, 20s);
  EXPECT_EQ(line.config.load_timeout, 5s);
  EXPECT_TRUE(line.config.strict_ixxat);
  EXPECT_TRUE(line.config.keep_operational);
  EXPECT_EQ(line.config.canopen_ia_base, 0x5F60);
  EXPECT_EQ(line.config.error_scheme, node::ErrorScheme::temporary_and_sticky);
  EXPECT_FALSE(line.config.reset_nodes);
  EXPECT_FALSE(line.config.start_nodes);
  EXPECT_TRUE(line.config.start_all);
  EXPECT_FALSE(line.config.own_start);
  EXPECT_EQ(line.config.on_error, manager::ErrorReaction::stop_all);
  EXPECT_EQ(line.config.boot_time, 30s);
  EXPECT_EQ(line.config.nmt_inhibit, 2ms);
  ASSERT_TRUE(line.config.flying_master);
  EXPECT_EQ(line.config.flying_master->priority, 1);
  EXPECT_EQ(line.config.flying_master->master_timeout, 150ms);
  EXPECT_EQ(line.config.flying_master->negotiation_delay, 400ms);
  EXPECT_EQ(line.config.flying_master->priority_slot, 2s);
  EXPECT_EQ(line.config.flying_master->device_slot, 8ms);
  EXPECT_EQ(line.config.flying_master->detect_cycle, 6s);
  EXPECT_EQ(line.config.flying_master->master_heartbeat, 3s);
  EXPECT_TRUE(line.config.flying_master->forces_each_cycle);
  EXPECT_EQ(line.config.identity.vendor, 0x1234U);
  EXPECT_EQ(line.config.identity.serial, 7U);
}

void expect_keys_of_own_objects(const LinePlan& line) {
  ASSERT_EQ(line.config.own_objects.size(), 2U);
  const line::OwnObject& recipe = line.config.own_objects[0];
  EXPECT_EQ(recipe.index, 0x2100);
  EXPECT_EQ(recipe.variable.sub, 1);
  EXPECT_EQ(recipe.variable.name, "Recipe");
  EXPECT_EQ(recipe.variable.type, od::DataType::unsigned16);
  EXPECT_EQ(recipe.variable.access, od::Access::rww);
  EXPECT_EQ(recipe.variable.value, (std::vector<std::byte>{std::byte{5}, std::byte{0}}));
  EXPECT_EQ(recipe.variable.low_limit.size(), 2U);
  EXPECT_EQ(recipe.variable.high_limit.front(), std::byte{100});
  EXPECT_TRUE(recipe.variable.mappable);
  EXPECT_TRUE(recipe.variable.store);
  EXPECT_TRUE(recipe.in_image);
  EXPECT_EQ(line.config.own_objects[1].variable.name, "Object 6100:00");
  EXPECT_FALSE(line.config.own_objects[1].in_image);
  ASSERT_EQ(line.config.own_values.size(), 1U);
  EXPECT_EQ(line.config.own_values[0].address, (od::Address{0x1007, 0}));
}

void expect_keys_of_the_runtime(const LinePlan& line) {
  EXPECT_EQ(line.commands, Access::all);
  EXPECT_EQ(line.outputs, Access::off);
  EXPECT_EQ(line.publish.rule, Publish::Rule::period);
  EXPECT_EQ(line.publish.time, 20ms);
  EXPECT_EQ(line.pdo_min_period, 1s);
  EXPECT_EQ(line.executor, "fast");
  EXPECT_EQ(line.storage, kRoot + "var/parameters");
  EXPECT_TRUE(line.config.stores_parameters);
  EXPECT_TRUE(line.named.published);
  EXPECT_EQ(line.named.min_separation, 50ms);
  EXPECT_THAT(
      line.named.aliases,
      testing::ElementsAre(named::Alias{image::Direction::inputs, "ram.Statusword", "State"},
                           named::Alias{image::Direction::outputs, "ram.Controlword", "Control"}));
  ASSERT_EQ(line.simulated.size(), 1U);
  EXPECT_EQ(line.simulated[0].profile, "drive");
}

void expect_keys_of_nodes(const LinePlan& line) {
  const line::NodeConfig& node = line.config.nodes.at(0);
  EXPECT_EQ(node.name, "ram");
  EXPECT_TRUE(node.mandatory);
  EXPECT_FALSE(node.check.vendor || node.check.product || node.check.revision);
  EXPECT_EQ(node.serial, 77U);
  EXPECT_EQ(node.heartbeat, 200ms);
  EXPECT_EQ(node.heartbeat_consumer, 700ms);
  EXPECT_EQ(node.boot_timeout, 3s);
  EXPECT_TRUE(node.keep_alive);
  EXPECT_EQ(node.reset_time, 4s);
  EXPECT_EQ(node.sdo_timeout, 2s);
  EXPECT_EQ(node.block_from, sdo::kNoBlocks);
  EXPECT_EQ(line.config.nodes.at(1).guard_time, 100ms);
  EXPECT_EQ(line.config.nodes.at(1).life_time_factor, 3);
  ASSERT_EQ(node.objects.size(), 1U);
  EXPECT_EQ(node.objects[0].address, (od::Address{0x6083, 0}));
  EXPECT_EQ(node.objects[0].data.size(), 4U);
}

void expect_keys_of_outputs(const LinePlan& line) {
  const auto made = line::Line::make(line.config);
  ASSERT_TRUE(made.ok());
  const auto& outputs = (*made.value)->layout(image::Direction::outputs);
  ASSERT_EQ(line.config.groups.size(), 2U);
  EXPECT_EQ(line.config.groups[0].number, 4);
  EXPECT_TRUE(line.config.groups[0].send_always);
  ASSERT_EQ(line.config.groups[0].entries.size(), 2U);
  EXPECT_EQ(outputs.entries[line.config.groups[0].entries[0]].index, 0x6040);
  EXPECT_EQ(outputs.entries[line.config.groups[0].entries[1]].index, 0x6060);
  EXPECT_THAT(line.named.groups,
              testing::ElementsAre(named::Group{"targets", 5, line.config.groups[1].entries}));
  EXPECT_TRUE(line.named.has_group(5));
  EXPECT_FALSE(line.named.has_group(4));
  ASSERT_EQ(line.config.defaults.size(), 1U);
  EXPECT_EQ(outputs.entries[line.config.defaults[0].entry].index, 0x6060);
  EXPECT_EQ(line.config.defaults[0].value & 0xFFU, 0xFFU);
}

TEST(Plant, ReadsEveryKeyOfALine) {
  const auto loaded = read_text(kEveryKeyOfALine);
  ASSERT_TRUE(loaded.ok()) << testing::PrintToString(messages(loaded));
  const Plant& plant = *loaded.value;
  expect_keys_of_the_gateway(plant);
  const LinePlan& line = plant.lines.at(0);
  expect_keys_of_the_manager(line);
  expect_keys_of_own_objects(line);
  expect_keys_of_the_runtime(line);
  expect_keys_of_nodes(line);
  expect_keys_of_outputs(line);
}

// It excludes flying_master, which the line above has.
TEST(Plant, ReadsTheKeysOfSleep) {
  const auto loaded = read_text(R"(schema: 1
gateway: {name: hall-7}
lines:
  - name: press
    interface: "simulated:"
    sleep: {request: 0x690, objection: 0x692, check_byte: 11, prepare_byte: 12, wake_byte: 13, objection_byte: 14, check_time: 2s, prepare_time: 3s, silent_time: 4s}
)");
  ASSERT_TRUE(loaded.ok()) << testing::PrintToString(messages(loaded));
  EXPECT_EQ(loaded.value->lines.at(0).config.sleep, (nmt::SleepProtocol{.request = 0x690,
                                                                        .objection = 0x692,
                                                                        .check_byte = 11,
                                                                        .prepare_byte = 12,
                                                                        .wake_byte = 13,
                                                                        .objection_byte = 14,
                                                                        .check_time = 2s,
                                                                        .prepare_time = 3s,
                                                                        .silent_time = 4s}));
}

TEST(Plant, SamplesAreValid) {
  for (const char* name :
       {"below-a-plc.yaml", "demo.yaml", "demo-fd.yaml", "slave.yaml", "vcan.yaml"}) {
    const auto loaded = load(kRoot + "deploy/plants/" + name);
    EXPECT_TRUE(loaded.ok()) << testing::PrintToString(messages(loaded));
    EXPECT_TRUE(loaded.diagnostics.empty()) << testing::PrintToString(messages(loaded));
  }
}

TEST(Plant, DemoHasThreeLinesAndTenDevices) {
  const auto loaded = load(kRoot + "deploy/plants/demo.yaml");
  ASSERT_TRUE(loaded.ok());
  std::size_t devices = 0;
  for (const auto& line : loaded.value->lines) {
    EXPECT_EQ(line.simulated.size(), line.config.nodes.size());
    devices += line.simulated.size();
  }
  EXPECT_EQ(loaded.value->lines.size(), 3U);
  EXPECT_GE(devices, 10U);
}

}  // namespace
}  // namespace linegate::config
