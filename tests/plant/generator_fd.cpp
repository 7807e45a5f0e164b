// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/generator_fd.h"

#include <array>
#include <iomanip>
#include <sstream>

#include "tests/plant/usdo_fields.h"

namespace linegate::plant {
namespace {

// Node-IDs of foreign clients, which no device of a plant has.
constexpr unsigned kFirstForeign = 121;
constexpr unsigned kForeign = 4;
constexpr unsigned kRequests = can::kSdoRequestBase;

std::string fd_frame_text(unsigned id, const std::vector<unsigned>& bytes) {
  std::ostringstream out;
  out << "frame " << id << " fd " << std::hex << std::uppercase << std::setfill('0');
  for (const unsigned byte : bytes) {
    out << std::setw(2) << (byte & 0xFFU);
  }
  return out.str();
}

}  // namespace

std::string ForeignClients::line_words() {
  constexpr std::array<unsigned, 3> kDataRates{1'000'000, 2'000'000, 5'000'000};
  return " canopen-fd data-bitrate " + std::to_string(kDataRates[below(3)]) +
         (below(3) == 0 ? " emcy-fd" : "");
}

// A read, also of the own node, or a write of an object that no configuration compares; outputs
// among them.
std::string ForeignClients::access(const Device& device) {
  constexpr unsigned kOwnNode = 127;
  const unsigned read = below(6) == 0 ? kOwnNode : device.id;
  const unsigned client = kFirstForeign + below(kForeign);
  const unsigned session = 1 + below(255);
  const unsigned sub = 1 + below(2);
  std::vector<unsigned> bytes;
  switch (below(4)) {
    case 0:
      bytes = {read, kUsdoUpload, session, 0, 0x08, 0x10};
      break;
    case 1:
      bytes = {read, kUsdoUpload, session, sub, 0x18, 0x10};
      break;
    case 2:
      bytes = {device.id, kUsdoDownload, session, 0, 0x15, 0x10, 6, 2, below(40), 0};
      break;
    default:
      bytes = {device.id, kUsdoDownload, session, sub, 0x00, 0x62, 5, 1, below(256)};
      break;
  }
  return fd_frame_text(kRequests + client, bytes);
}

// The begin of a download of 2F00h that never ends, or a segment of it: the object is in use.
std::string ForeignClients::unfinished(const Device& device) {
  constexpr unsigned kFirstSession = 9;  // those of garbage() are lower
  const unsigned session = kFirstSession + below(2);
  std::vector<unsigned> bytes{
      device.id, kUsdoDownloadInitiate, session, 0, 0x00, 0x2F, 0x0F, 0, below(256), 1, 0, 0};
  if (below(2) == 0) {
    bytes.assign(can::kMaxFdData, below(256));
    bytes[0] = device.id;
    bytes[1] = kUsdoDownloadSegment;
    bytes[2] = session;
    bytes[3] = below(3);  // counter
  }
  return fd_frame_text(kRequests + kFirstForeign, bytes);
}

// A frame of the protocol with any command and any content.
std::string ForeignClients::garbage(const Device& device) {
  constexpr std::array<unsigned, 8> kCommands{
      kUsdoDownloadInitiate, kUsdoDownloadSegment, kUsdoDownloadEnd, kUsdoUpload,
      kUsdoUploadSegment,    kUsdoAbort,           kUsdoLongAbort,   0x55};
  std::vector<unsigned> bytes{device.id, kCommands[below(8)], 1 + below(8)};
  const unsigned count = below(30);
  for (unsigned i = 0; i < count; ++i) {
    bytes.push_back(below(256));
  }
  return fd_frame_text(kRequests + kFirstForeign + below(kForeign), bytes);
}

// Any identifier except those of NMT commands and of the own node, and any length.
std::string ForeignClients::any_frame() {
  std::vector<unsigned> bytes(1 + below(can::kMaxFdData));
  for (unsigned& byte : bytes) {
    byte = below(256);
  }
  const unsigned id = 1 + below(0x7FF);
  const bool is_own = (id & 0x7FU) == 0x7F;
  return fd_frame_text(is_own ? id - 1 : id, bytes);
}

ForeignClients::Actions ForeignClients::draw(const std::vector<Device>& devices, unsigned time) {
  constexpr unsigned kNear = 30;  // ms
  Actions out;
  const unsigned count = below(3) == 0 ? 1 + below(4) : 0;
  for (unsigned i = 0; i < count; ++i) {
    const Device& device = devices[below(static_cast<unsigned>(devices.size()))];
    const unsigned when = time + below(kNear);
    const unsigned kind = below(8);
    out.emplace_back(when, kind == 0   ? any_frame()
                           : kind == 1 ? unfinished(device)
                           : kind <= 3 ? garbage(device)
                                       : access(device));
  }
  return out;
}

}  // namespace linegate::plant
