// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/answer_model.h"

#include <algorithm>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/lss/message.h"

#include "tests/plant/request_fields.h"
#include "tests/plant/usdo_fields.h"

namespace linegate::plant {
namespace {

unsigned byte_at(const can::Frame& frame, std::size_t at) {
  return std::to_integer<unsigned>(frame.data[at]);
}

// CiA 301 7.2.4.3: the three highest bits of an SDO message.
unsigned specifier(const can::Frame& frame) {
  return byte_at(frame, 0) >> 5U;
}

od::Address multiplexer(const can::Frame& frame) {
  return {load_le<std::uint16_t>(frame.data.data() + 1),
          static_cast<std::uint8_t>(byte_at(frame, 3))};
}

// The data bytes of a segment, without the unused ones.
std::span<const std::byte> segment_of(const can::Frame& frame) {
  return std::span(frame.data).subspan(1, 7 - (byte_at(frame, 0) >> 1U & 7U));
}

// The data bytes of an expedited transfer; all four if their number is not indicated.
std::span<const std::byte> expedited_of(const can::Frame& frame) {
  const bool indicated = (byte_at(frame, 0) & 1U) != 0;
  return std::span(frame.data).subspan(4, indicated ? 4 - (byte_at(frame, 0) >> 2U & 3U) : 4);
}

bool is_expedited(const can::Frame& frame) {
  return (byte_at(frame, 0) & 2U) != 0;
}

constexpr unsigned kBlockAck = 0xA2;      // the same command in both directions
constexpr unsigned kBlockTakeEnd = 0xA1;  // from the side that receives the value
constexpr unsigned kLastSegment = 0x80;
constexpr unsigned kNumber = 0x7F;  // number of a segment
constexpr std::size_t kSegmentSize = 7;

// The end of a block transfer, from the side that sends the value.
bool is_block_end(unsigned command) {
  return (command & 0xE3U) == 0xC1;
}

std::uint64_t word_of(const can::Frame& frame) {
  return load_le<std::uint64_t>(frame.data.data());
}

void append(std::vector<std::byte>& to, std::span<const std::byte> bytes) {
  to.insert(to.end(), bytes.begin(), bytes.end());
}

// The node-ID, if the frame belongs to the default SDO of a node; else 0.
std::uint8_t sdo_of(const can::Frame& frame, std::uint32_t base) {
  const bool is = frame.standard_of(can::kMaxClassicData) && frame.id > base &&
                  frame.id <= base + can::kMaxNodeId;
  return is ? static_cast<std::uint8_t>(frame.id - base) : std::uint8_t{0};
}

}  // namespace

void AnswerModel::lost(std::uint64_t first, std::uint64_t last) {
  std::erase_if(sent_,
                [&](const Sent& sent) { return sent.number >= first && sent.number <= last; });
  for (auto& [tag, given] : given_) {
    given.lost = true;
  }
}

// --- frames -------------------------------------------------------------------------------------

void AnswerModel::submitted(const can::Frame& frame, Instant now) {
  ++submitted_;
  check_refused_values(frame);
  if (is_usdo(frame, can::kSdoRequestBase)) {
    usdo_request(frame);
  } else if (const std::uint8_t node = sdo_of(frame, can::kSdoRequestBase); node != 0) {
    request(node, frame);
  } else if (!given_.empty()) {
    sent_.push_back({.frame = frame,
                     .number = submitted_,
                     .after = commands_,
                     .newest = has_newest(frame, now)});
  }
}

void AnswerModel::before_receive(const can::Frame& frame) {
  if (is_usdo(frame, can::kSdoResponseBase)) {
    usdo_response(frame);
  } else if (const std::uint8_t node = sdo_of(frame, can::kSdoResponseBase); node != 0) {
    response(node, frame);
  } else if (frame.id == lss::kSlaveId && frame.standard_of(can::kMaxClassicData)) {
    lss_answers_[static_cast<std::uint8_t>(byte_at(frame, 0))] = {frame, commands_};
  }
}

void AnswerModel::request(std::uint8_t node, const can::Frame& frame) {
  enum : unsigned {
    download_segment,
    download,
    upload,
    upload_segment,
    abort,
    block_upload,
    block
  };
  Transfer& transfer = transfers_[node];
  const unsigned kind = specifier(frame);
  if (transfer.phase == Phase::blocks && block_request(transfer, frame)) {
    return;
  }
  if (kind == abort) {
    transfer = {};
    return;
  }
  const bool initiates = kind == download || kind == upload ||
                         (kind == block_upload && (byte_at(frame, 0) & 3U) == 0) ||
                         (kind == block && (byte_at(frame, 0) & 1U) == 0);
  if (initiates) {
    transfer = {.phase = Phase::initiated,
                .upload = kind == upload || kind == block_upload,
                .block = kind == block_upload || kind == block,
                .address = multiplexer(frame),
                .value = {}};
    begun_[node] = commands_;
    if (kind == download && is_expedited(frame)) {
      append(transfer.value, expedited_of(frame));
      transfer.last = true;
      transfer.whole = true;
    }
  } else if (kind == download_segment && transfer.phase == Phase::segments) {
    append(transfer.value, segment_of(frame));
    transfer.last = (byte_at(frame, 0) & 1U) != 0;
    transfer.whole = transfer.last;
    transfer.toggle = (byte_at(frame, 0) & 0x10U) != 0;
  } else if (kind == upload_segment) {
    transfer.toggle = (byte_at(frame, 0) & 0x10U) != 0;
  }
}

void AnswerModel::response(std::uint8_t node, const can::Frame& frame) {
  enum : unsigned { segment, downloaded, initiated, download_begins, abort, block_down, block_up };
  Transfer& transfer = transfers_[node];
  const unsigned kind = specifier(frame);
  const bool fits = multiplexer(frame) == transfer.address;
  if (transfer.phase == Phase::blocks) {
    block_response(node, frame);
  } else if (transfer.phase == Phase::initiated && fits) {
    if (kind == download_begins && !transfer.upload && !transfer.block) {
      transfer.phase = Phase::segments;
      if (transfer.last) {
        end(node);
      }
    } else if (kind == initiated && transfer.upload) {
      transfer.phase = Phase::segments;
      if (is_expedited(frame)) {
        append(transfer.value, expedited_of(frame));
        end(node);
      }
    } else if (transfer.block && kind == (transfer.upload ? block_up : block_down)) {
      constexpr std::size_t kBlockSize = 4;
      transfer.phase = Phase::blocks;
      transfer.size = byte_at(frame, kBlockSize);
    }
  } else if (transfer.phase == Phase::segments && kind != abort) {
    const bool toggle = (byte_at(frame, 0) & 0x10U) != 0;
    if (toggle != transfer.toggle || kind != (transfer.upload ? segment : downloaded)) {
      return;
    }
    if (transfer.upload) {
      append(transfer.value, segment_of(frame));
      transfer.last = (byte_at(frame, 0) & 1U) != 0;
    }
    if (transfer.last) {
      end(node);
    }
  }
}

// --- blocks (CiA 301 7.2.4.3.9 to 7.2.4.3.16) ---------------------------------------------------

// Adds a segment to the current sub-block, if it is the next one in order, or the first one again.
// Segments that are queued when a sub-block is acknowledged too early continue its numbers and are
// ignored.
void AnswerModel::receive_segment(Transfer& transfer, const can::Frame& frame) {
  const unsigned number = byte_at(frame, 0) & kNumber;
  const bool again = number == 1 && !transfer.upload;
  transfer.newest = number;
  if (number == 0 || transfer.last || (number != transfer.segments + 1 && !again)) {
    return;
  }
  const std::size_t place = (number - 1) * kSegmentSize;
  transfer.sub_block.resize(place);
  append(transfer.sub_block, std::span(frame.data).subspan(1, kSegmentSize));
  transfer.segments = number;
  transfer.ends = (byte_at(frame, 0) & kLastSegment) != 0;
  transfer.last_segment = word_of(frame);
}

// Appends the first `count` segments of the sub-block to the value, and begins another sub-block.
void AnswerModel::receive_sub_block(Transfer& transfer, unsigned count) {
  const std::size_t bytes = std::min(count, transfer.segments) * kSegmentSize;
  append(transfer.value, std::span(transfer.sub_block).first(bytes));
  transfer.last = transfer.ends && count == transfer.segments;
  transfer.segments = 0;
  transfer.ends = false;
}

// The last segment need not be full.
void AnswerModel::receive_block_end(Transfer& transfer, const can::Frame& frame) {
  const std::size_t unused = byte_at(frame, 0) >> 2U & 7U;
  transfer.value.resize(transfer.value.size() - std::min(unused, transfer.value.size()));
}

// Segments of a block look like other requests, except for their numbers. Returns false for another
// request.
bool AnswerModel::block_request(Transfer& transfer, const can::Frame& frame) {
  const unsigned command = byte_at(frame, 0);
  if (transfer.upload) {
    if (command == kBlockAck) {
      receive_sub_block(transfer, byte_at(frame, 1));
    }
    return command == kBlockAck;
  }
  if (transfer.last && is_block_end(command)) {
    receive_block_end(transfer, frame);
    transfer.whole = true;
    return true;
  }
  const unsigned number = command & kNumber;
  const bool is_segment = number == 1 || number == transfer.newest + 1;
  if (is_segment) {
    receive_segment(transfer, frame);
  }
  return is_segment;
}

// A repeated acknowledgement does not belong to the next sub-block, which was not sent yet.
void AnswerModel::block_response(std::uint8_t node, const can::Frame& frame) {
  Transfer& transfer = transfers_[node];
  const unsigned command = byte_at(frame, 0);
  if (transfer.upload) {
    const bool repeated = word_of(frame) == transfer.last_segment;
    if (transfer.last && is_block_end(command) && !repeated) {
      receive_block_end(transfer, frame);
      end(node);
    } else {
      receive_segment(transfer, frame);
    }
  } else if (command == kBlockTakeEnd) {
    end(node);
  } else if (command == kBlockAck) {
    const bool whole = transfer.ends || transfer.segments == transfer.size;
    if (whole || word_of(frame) != transfer.acknowledged) {
      receive_sub_block(transfer, byte_at(frame, 1));
      transfer.size = byte_at(frame, 2);
      transfer.acknowledged = word_of(frame);
    }
  }
}

void AnswerModel::end(std::uint8_t node) {
  Transfer transfer = std::exchange(transfers_[node], {});
  if (!given_.empty()) {
    done_.push_back({.transfer = std::move(transfer), .node = node, .after = begun_[node]});
  }
}

// --- answers ------------------------------------------------------------------------------------

std::string AnswerModel::answered(const line::Reply& reply, std::span<const Event> events,
                                  Instant now) {
  const auto found = given_.find(reply.tag);
  if (found == given_.end()) {
    return {};
  }
  const Given given = found->second;
  given_.erase(found);
  std::string out =
      reply.ok() ? check_done(given, reply) : check_refusal(given, reply, events, now);
  if (reply.error == to_error(AbortCode::timeout) && may_be_transferred(given)) {
    transfers_[line::node_of(given.command) & can::kMaxNodeId].whole = false;  // it was this one's
  }
  if (given_.empty()) {
    sent_.clear();
    done_.clear();
  }
  return out.empty() ? out
                     : "command " + std::to_string(reply.tag) + " (" +
                           std::string(line::name(line::kind(given.command))) +
                           ") is answered as " + (reply.ok() ? "done: " : "not done: ") + out;
}

std::string AnswerModel::check_done(const Given& given, const line::Reply& reply) {
  const line::Command& command = given.command;
  const line::CommandKind asked = line::kind(command);
  const line::LineConfig& config = line_.config();
  const bool own = config.role != line::Role::manager || line::node_of(command) == config.node_id;
  using enum line::CommandKind;
  if (asked == lss) {
    return check_lss(given, reply);
  }
  const bool by_sdo =
      asked == object_write && std::holds_alternative<line::WrittenBySdo>(reply.data);
  const auto* const read = as<line::SdoRead>(command);
  const bool by_transfer = read != nullptr && !read->from_image && !read->from_scan;
  if ((by_transfer || asked == sdo_write || by_sdo) && !own) {
    return check_transfer(given, reply);
  }
  const bool frame = (asked == nmt && !own) || asked == can_send || asked == emcy_send ||
                     asked == mpdo_write || asked == pdo_trigger;
  if (frame) {
    return check_sent(given);
  }
  const bool output = asked == output_write || asked == object_write;
  return output ? check_output(given, reply) : std::string();
}

// Whether the present transfer with the node of the command may be that of the command.
bool AnswerModel::may_be_transferred(const Given& given) const {
  const std::uint8_t node = line::node_of(given.command);
  const Transfer& transfer = transfers_[node & can::kMaxNodeId];
  return (as<line::SdoWrite>(given.command) != nullptr ||
          as<line::ObjectWrite>(given.command) != nullptr) &&
         transfer.whole && given.order <= begun_[node & can::kMaxNodeId] &&
         address_of(given.command) == transfer.address &&
         std::ranges::equal(data_of(given.command), transfer.value);
}

// Clause 10.
bool AnswerModel::may_be_carried_out(const Given& given) const {
  return as<line::SdoWrite>(given.command) != nullptr && may_be_transferred(given) &&
         std::ranges::none_of(given_,
                              [&](const auto& each) { return may_be_transferred(each.second); });
}

std::string AnswerModel::check_transfer(const Given& given, const line::Reply& reply) {
  const line::Command& command = given.command;
  const bool reads = as<line::SdoRead>(command) != nullptr;
  const std::span<const std::byte> value = reads ? reply.bytes() : data_of(command);
  const auto it = std::ranges::find_if(done_, [&](const Done& done) {
    return done.node == line::node_of(command) && done.after >= given.order &&
           done.transfer.upload == reads && done.transfer.address == address_of(command) &&
           std::ranges::equal(done.transfer.value, value);
  });
  if (it == done_.end()) {
    return "no transfer of its object with this value came to its end";
  }
  done_.erase(it);
  return {};
}

}  // namespace linegate::plant
