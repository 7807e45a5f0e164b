// SPDX-License-Identifier: Apache-2.0
// The implementation of pdo::Engine; private to stack/pdo.
//
// A slot is a PDO number - 1. Data that is needed for each frame is separate from that for
// configuration and timing: Rpdo is a quarter of a cache line, the marks are in the image's Area.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "stack/image/process_image.h"
#include "stack/pdo/bitmap.h"
#include "stack/pdo/copy_plan.h"
#include "stack/pdo/engine.h"
#include "stack/pdo/link.h"
#include "stack/pdo/object_sources.h"
#include "stack/pdo/reception_queues.h"
#include "stack/pdo/record.h"
#include "stack/pdo/shadows.h"
#include "stack/pdo/timers.h"
#include "stack/pdo/values_under_way.h"

namespace linegate::pdo {

// Reasons in image::PdoState::attention besides kNotValid.
enum Attention : std::uint32_t {
  kFirst = 0x02,     // no frame yet since Operational: the deadline starts with the first one
  kTimedOut = 0x04,  // the deadline was missed
  kLengthReported =
      0x08  // a wrong length was reported; the next frame of the right length clears it
};

// The part of an RPDO that is needed for each frame. Frames of up to 8 bytes are one word.
struct alignas(16) Rpdo {
  static constexpr std::uint8_t kNever = 0xFF;  // different from form() of every frame
  enum Flag : std::uint8_t {
    kMore = 0x01,     // its RpdoDetails have further runs, or objects
    kLong = 0x02,     // it has more than 8 bytes
    kWatched = 0x04,  // a hook watches one of its objects
    kQueued = 0x08,   // it has a queue of receptions
  };

  std::uint64_t mask = 0;  // of the first Run; 0 if no value is in the image
  std::uint32_t offset = 0;
  std::uint8_t rotate = 0;
  std::uint8_t at_once = kNever;  // form() of one-word frames that are just copied
  // form() of frames of up to 8 bytes that are kept for the next SYNC.
  std::uint8_t deferred = kNever;
  std::uint8_t flags = 0;  // Flag values or-ed

  // Length and remote flag of a frame in one number.
  static std::uint8_t form(const can::Frame& frame) {
    return static_cast<std::uint8_t>(frame.length | (frame.flags & can::Frame::kRemote) << 6U);
  }
  std::uint64_t to_image(std::uint64_t frame_word) const { return std::rotr(frame_word, rotate); }
};
static_assert(sizeof(Rpdo) == 16);

// The other data of an RPDO.
struct RpdoDetails {
  bool active = false;
  can::CobId cob_id;
  std::uint8_t type = kEventProfile;
  MpdoMode mpdo = MpdoMode::none;
  bool is_srdo = false;  // passed to receive() alone, when it is valid
  bool refused = false;  // the last MPDO in destination address mode was refused
  Duration deadline{};
  CopyPlan plan;
  std::vector<od::Address> watched;     // mapped objects that a hook watches
  std::size_t long_shadow = kNoShadow;  // index in Engine::Impl::long_shadows

  static constexpr std::size_t kNoShadow = SIZE_MAX;
};

// The data that each transmission needs comes first, in one cache line with the header of the frame
// and the first 8 bytes of its data.
struct alignas(64) Tpdo {
  const Run* runs = nullptr;           // from the plan
  const ObjectRun* objects = nullptr;  // from the plan, see lay_out_objects()
  std::uint64_t samples = 0;           // number of samples since it was configured
  std::uint8_t run_count = 0;
  std::uint8_t object_count = 0;
  std::uint16_t rank = 0;  // position among the TPDOs in the order of bus priority
  std::uint8_t type = kEventProfile;
  MpdoMode mpdo = MpdoMode::none;
  std::uint8_t syncs = 0;  // number of SYNCs since it was sent
  bool active = false;
  bool direct = false;   // a changed value requests it at once, see change()
  bool plain = false;    // nothing follows from its transmission, see send_plain()
  bool linked = false;   // held back until its output entries are known
  bool timed = false;    // has an inhibit time or an event timer
  bool sampled = false;  // frame holds a sample, taken since Operational
  bool asking = false;   // the listener's before_tpdo() is running
  bool event = false;    // type 0: requested for the next SYNC
  bool of_sync = false;  // sampled at a SYNC
  can::Frame frame;      // the newest sample

  // The first objects if there are no more: their address is known before the rest is read.
  static constexpr std::size_t kNear = 4;
  alignas(64) std::array<ObjectRun, kNear> near_objects{};

  std::uint8_t node = 0;  // of a linked TPDO: the receiver
  std::uint8_t sync_start = 0;
  bool counting = false;  // the SYNC start value was received
  can::CobId cob_id;
  Duration inhibit{};  // of event-driven TPDOs only
  Duration event_timer{};
  Instant inhibited_until{};
  CopyPlan plan;
  od::Address sent_object;             // of an MPDO in destination address mode
  std::vector<MpdoData> mpdos{};       // waiting, oldest first
  std::vector<MpdoData> held_mpdos{};  // waiting for release_held()

  // The data of the frame is one word.
  bool is_word() const { return frame.length <= can::kMaxClassicData; }
};
static_assert(offsetof(Tpdo, frame) + offsetof(can::Frame, data) + can::kMaxClassicData == 64);

struct Engine::Impl final : od::Hook, od::Observer {
  // sending, asking: the members of Engine.
  Impl(od::Dictionary& d, can::Dispatch& p, EventLog& e, image::ProcessImage* i,
       std::uint64_t& sending, std::uint64_t& asking);
  ~Impl() override;

  // --- configuration (configure.cpp) ------------------------------------------------------------
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  void written(od::Address address) override;
  std::vector<Diagnostic> configure();
  // The reason why a PDO is not active; AbortCode::none if there is none.
  struct Problem {
    AbortCode why = AbortCode::none;
    od::Address place{};
    std::string text{};
  };
  // The last problem of a PDO that was reported to the listener; none after it ended.
  struct ReportedProblem {
    AbortCode why = AbortCode::none;
    od::Address place{};
    bool operator==(const ReportedProblem&) const = default;
  };
  // Reports a new problem to the listener.
  Problem compile(PdoKind kind, std::uint16_t number);
  Problem try_to_compile(PdoKind kind, std::uint16_t number);
  Problem compile_plan(PdoKind kind, std::uint16_t number, CopyPlan& plan) const;
  Problem compile_mpdo(PdoKind kind, const Parameters& parameters, CopyPlan& plan) const;
  void read_scanner_list();
  void reserve_mpdos(Tpdo& pdo);
  void read_dispatcher_list();
  void start_mpdo(Tpdo& pdo, MpdoMode mode, std::uint16_t number);
  Problem map_objects(PdoKind kind, std::uint16_t number, CopyPlan& plan) const;
  AbortCode map_object(PdoKind kind, const Mapping& mapping, CopyPlan& plan) const;
  const LinkedPdo* linked(PdoKind kind, std::uint16_t number) const;
  std::uint16_t highest_number(PdoKind kind) const;
  std::optional<Parameters> parameters(PdoKind kind, std::uint16_t number) const;
  void start_rpdo(const Parameters& parameters, CopyPlan plan);
  void start_tpdo(const Parameters& parameters, CopyPlan plan);
  void stop(PdoKind kind, std::uint16_t slot);
  void stop_all();
  void hook_records(od::Hook* hook);

  // --- objects that are added, removed and watched (dictionary_changes.cpp) ----------------------
  void reshaped(std::uint16_t index) override;
  void changed(od::Address address, od::FollowMark mark) override;
  void changed_otherwise(od::Address address, od::FollowMark mark);
  void follow_sources();
  bool depends_on(PdoKind kind, std::uint16_t number, std::uint16_t index) const;
  std::vector<od::Address> watched_objects(std::uint16_t rpdo) const;
  void notify_watched(std::uint16_t slot);

  // --- data derived from all PDOs together (schedule.cpp) ---------------------------------------
  void lay_out();
  void lay_out_rpdos();
  void rank_tpdos();
  void lay_out_objects();
  void forget_sources();
  // All handles of values become invalid: before a TPDO stops, and when all have a place again.
  void renew_revision() {
    ++revision;
    follow_mode();
  }
  void index_sources();
  void set_operational(bool on, Instant now);
  void open_rpdos();
  void begin(PdoKind kind, std::uint16_t slot);
  void go_quiet();

  // --- reception (receive.cpp) ------------------------------------------------------------------
  // The parts of Engine::receive_alone() for frames that are copied at once, and for those that
  // wait for SYNC.
  bool copy_alone(std::uint16_t slot, const can::Frame& frame, can::Traffic& traffic);
  bool keep_alone(std::uint16_t slot, const can::Frame& frame, can::Traffic& traffic);
  // See Engine::receive_ordinary().
  bool is_for_rpdo(const can::Frame& frame) const {
    const can::Target* const target = dispatch.find(frame);
    return target != nullptr && target->alone_of(can::Service::rpdo);
  }
  std::size_t receive_series(std::span<const can::Frame> frames, can::Traffic& traffic);
  void take(std::uint16_t slot, const std::byte* data, Instant time, std::uint32_t frames);
  void copy_rest(std::uint16_t slot, const std::byte* data);
  void defer(std::uint16_t slot, const can::Frame& frame);
  void keep(std::uint16_t slot, const can::Frame& frame);
  // Adds the frame to the queue of the RPDO, if it has one.
  void queue_reception(std::uint16_t slot, const can::Frame& frame) {
    if ((rpdos[slot].flags & Rpdo::kQueued) != 0) {
      receptions.push(slot, frame);
      counters.receptions_lost = receptions.lost();
    }
  }
  void assign_queues();
  bool pop_reception(Reception& out);
  // early.cpp
  void receive_early(std::uint16_t slot, const can::Frame& frame);
  void process_early();
  // receive.cpp
  void receive_wrong_length(std::uint16_t slot, const can::Frame& frame);
  // multiplexed.cpp
  void receive_mpdo(std::uint16_t slot, const can::Frame& frame);
  void store_mpdo(std::uint16_t slot, const Mpdo& mpdo, od::Address place, Instant time);
  // most: largest number of waiting MPDOs, including this one.
  AbortCode queue_mpdo(std::uint16_t slot, Mpdo mpdo, od::Address source,
                       std::size_t most = kMpdosWaiting);
  AbortCode put_mpdo(std::vector<MpdoData>& waiting, const Tpdo& pdo, const MpdoData& data,
                     std::size_t most);
  void scanned_changed(od::Address address);
  void release_mpdos(Tpdo& pdo);
  void show_first_mpdo(Tpdo& pdo);
  // The first waiting MPDO was handed out. number: see next_frame().
  void next_mpdo(std::uint16_t slot, std::uint64_t number);
  void confirm_mpdo(const MpdoData& data);
  void mpdos_acknowledged(std::uint64_t number);
  void mpdos_lost(std::uint64_t first, std::uint64_t last);
  // The MPDO in source address mode with the present value; nothing if there is no such object.
  std::optional<MpdoData> present_mpdo(od::Address source) const;
  void attend(std::uint16_t slot, Instant time);
  void attend_reception(std::uint16_t slot, Instant time);
  void commit_rpdos();
  bool commit_one(const Shadow& shadow);
  void commit_each();
  std::size_t commit_ordinary(std::size_t from);
  void commit(const Shadow& shadow);
  can::Frame remote_frame(std::uint16_t slot) const;
  void check_deadline(std::uint16_t slot, Instant now);
  void report_length(std::uint16_t slot, const can::Frame& frame);
  void report_valid_length(std::uint16_t slot);
  void open_window(Instant sync);
  void close_window(Instant now) {
    if (window_open && now >= window_end) [[unlikely]] {
      drop_what_missed_the_window();
    }
  }
  void drop_what_missed_the_window();
  void report(std::uint16_t slot, Instant time, const EventData& data);

  // --- transmission (transmit.cpp) --------------------------------------------------------------
  void sample_tpdos(std::uint8_t counter);
  void sample_again();
  bool due_at_sync(Tpdo& pdo, std::uint8_t counter) const;
  bool held_back(std::uint16_t slot) const;
  using FrameData = std::array<std::byte, can::kMaxFdData>;
  // The present values; gather_word(): for a frame that is one word.
  FrameData gather(const Tpdo& pdo) const;
  std::uint64_t gather_word(const Tpdo& pdo) const;
  void set_receiver(std::uint8_t node, Receiver state);
  // The frame of a linked TPDO was handed out: its entries with their newest values become valid
  // when it is acknowledged.
  void note_transmission(std::uint16_t slot);
  bool has_untransmitted(std::uint16_t slot, const Tpdo& pdo) const;
  void forget_transmission();
  void confirm(std::uint16_t slot, const FrameData& differs);
  // Whether the newest values are known, and are those of its last sample.
  bool is_newest(std::uint16_t slot) const;
  bool shows_newest(std::uint16_t slot) const;  // the same for a linked TPDO; false for others
  bool is_taken(std::uint16_t slot) const;
  void acknowledged(std::uint64_t number);
  void lost(std::uint64_t first, std::uint64_t last);
  // The bits that are not in the newest sample, or none of which was requested: see
  // Engine::awaits_trigger(). Nothing if the TPDO comes by itself, or is no such TPDO.
  std::optional<FrameData> unrequested(std::uint16_t number) const;
  // Whether it will be requested without an event, or at the next SYNC by an earlier event.
  bool comes_by_itself(std::uint16_t slot) const;
  // Takes a new sample. Returns true if it is the first, or differs from the previous one.
  bool sample(std::uint16_t slot);
  void replace_sample(std::uint16_t slot, const FrameData& data);
  // Samples and requests the TPDO; without always only if the sample has changed.
  void request(std::uint16_t slot, bool always);
  void source_changed(std::uint16_t slot, bool always);
  // One of the values of a direct TPDO has changed.
  void change(Tpdo& pdo);
  // See Engine::set(), for a handle whose TPDO is not requested at once.
  bool set_otherwise(const TpdoValue& value, std::uint64_t word);
  std::uint16_t slot_of(const Tpdo& pdo) const {
    return static_cast<std::uint16_t>(&pdo - tpdos.data());
  }
  void follow_mode() {
    direct = operational && !held && !hears_frames;
    direct_handles = direct ? handles_of_direct_tpdos() : kNoHandle;
  }
  // TpdoValue::revision_ of values that direct TPDOs send; of others it is larger by 1.
  std::uint64_t handles_of_direct_tpdos() const { return 2 * revision; }
  // Marks in `affected` the TPDOs that send some of these bits of the output area.
  void mark_affected(std::uint32_t bit_offset, std::uint32_t bits);
  void output_variable_changed(od::Address address);
  // Calls before_tpdo() of the listener, which may change values; these changes do not request the
  // TPDO.
  void ask(std::uint16_t slot);
  void on_event_timer(std::uint16_t slot, Instant now);
  void release(Instant now);
  void end_times(Instant now);
  bool next_frame_in_turn(can::Frame& out, Instant now, std::uint64_t number, can::Traffic& sent);
  bool peek(can::Frame& out, Instant now);
  // The rank of the first TPDO that may be sent; kNoRank if there is none.
  std::size_t first_ready() const;
  std::size_t first_remote_frame(can::Frame& out) const;
  bool next_remote_frame(can::Frame& out, std::size_t rank);
  void release_held();
  // Hand out the frame of a requested TPDO; return true. number: see next_frame(). send_plain(): of
  // a TPDO with up to 8 bytes and an 11-bit identifier, without times and without marks in an
  // image.
  bool send_plain(const Tpdo& pdo, can::Frame& out, can::Traffic& sent);
  bool send(std::size_t rank, can::Frame& out, Instant now, std::uint64_t number,
            can::Traffic& sent);
  void start_times(std::uint16_t slot, Instant now);
  bool wants_to_send(Instant now) const;
  Instant next_sending() const;

  static constexpr std::size_t kNoRank = SummedBitmap::kNone;

  // Numbers of timers: first the deadlines of the RPDOs, then the event timers of the TPDOs.
  std::size_t event_timer(std::size_t slot) const { return rpdos.size() + slot; }
  static bool has_event_timer(const Tpdo& pdo) {
    return is_event_driven(pdo.type) && pdo.event_timer > Duration::zero() &&
           pdo.mpdo == MpdoMode::none;
  }

  // --- data for receive() -----------------------------------------------------------------------
  std::vector<Rpdo> rpdos;
  image::Area* inputs = nullptr;
  Listener* listener = nullptr;
  static constexpr std::uint64_t kNoHandle = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t revision = 1;
  std::uint64_t direct_handles = kNoHandle;  // handles_of_direct_tpdos() while `direct`
  EngineCounters counters;
  Shadows shadows;            // frames of synchronous RPDOs, and of RPDOs before Operational
  bool hears_frames = false;  // the listener uses rpdo_received() and before_tpdo()
  bool direct = false;        // Operational, no hold(), and no calls of before_tpdo()

  od::Dictionary& dictionary;
  can::Dispatch& dispatch;
  EventLog& events;
  std::unique_ptr<image::ProcessImage> own_image;  // for the marks, if the device has no image
  image::ProcessImage& image;
  image::Area* outputs = nullptr;
  std::size_t max_bytes = can::kMaxClassicData;
  bool operational = false;
  bool reports_transmission = false;  // see follow_transmission()
  bool keeps_early = false;
  std::uint8_t node_id = 0;
  std::array<Receiver, can::kMaxNodeId + 1> receivers{};  // of linked TPDOs, by node-ID
  Instant latest{};  // time of the last call, because writes to records have no time

  ReceptionQueues receptions;
  std::vector<LinkedPdo> linked_rpdos;
  std::vector<LinkedPdo> linked_tpdos;
  std::vector<RpdoDetails> details;
  std::vector<ReportedProblem> reported_rpdos;  // by slot
  std::vector<ReportedProblem> reported_tpdos;
  std::vector<std::array<std::byte, can::kMaxFdData>> long_shadows;  // frames longer than 8 bytes

  std::vector<Tpdo> tpdos;
  std::vector<ObjectRun> object_runs;     // of all TPDOs, side by side: of their plans
  std::vector<std::uint16_t> by_rank;     // slots
  std::vector<const Tpdo*> ranked;        // the same TPDOs
  Duration window{};                      // 1007h
  Instant window_end = kNever;            // of the current window
  bool window_open = false;               // the TPDOs of the window were not dropped yet
  std::vector<std::uint16_t> sync_tpdos;  // slots of types 0..240 and 252
  SummedBitmap pending;                   // by rank: sampled and requested
  Bitmap inhibited;                       // by rank
  Instant next_release = kNever;          // the earliest end of an inhibit time
  SummedBitmap asked;                     // by slot: RPDOs to request with a remote frame
  bool held = false;                      // requests wait for release_held()
  Bitmap held_changed;                    // by slot: request if the value has changed
  Bitmap held_always;                     // by slot: request in any case
  std::uint64_t frame_number = 0;         // of the current frame, see note_transmission()
  std::uint64_t awaiting = 0;             // summary of unacknowledged
  SummedBitmap unacknowledged{awaiting};  // by slot: under_way or mpdos_under_way has frames
  // By slot: linked TPDOs with values that are not valid, and those of follow_transmission().
  std::vector<ValuesUnderWay> under_way;
  struct MpdoUnderWay {
    MpdoData data{};
    std::uint64_t number = 0;
  };
  // With follow_transmission(): of each object of the scanner list the newest MPDO, if it is not
  // acknowledged yet.
  std::vector<MpdoUnderWay> mpdos_under_way;
  Bitmap affected;  // by slot: temporary result of mark_affected()
  struct Source {
    std::uint32_t begin = 0;  // bits of the output area
    std::uint32_t end = 0;
    std::uint16_t slot = 0;
  };
  std::vector<Source> sources;  // ascending by begin; each has at most 64 bits
  bool shares_outputs = false;  // TPDOs outside of link() also send output entries
  ObjectSources object_sources;
  std::bitset<kMaxPdo> auto_notify;  // by slot
  struct Followed {
    od::Address address;
    od::FollowMark mark = 0;
  };
  std::vector<Followed> followed;  // in the dictionary
  ScannerList scanner_list;
  std::size_t scanned_objects = 0;  // existing objects in the scanner list
  DispatcherList dispatcher_list;
  std::vector<od::Address> mpdo_places;      // temporary
  std::optional<std::uint16_t> source_tpdo;  // slot of the MPDO in source address mode
  Timers timers;
};

}  // namespace linegate::pdo
