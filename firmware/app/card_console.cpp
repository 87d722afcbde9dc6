#include "app/card_console.h"

#include "app/card_store.h"
#include "app/pilot_link.h"
#include "core/envelope.h"
#include "hal/relay.h"
#include "hal/serial.h"

namespace app {

using frames::CardCommand;
using frames::CardFault;
using frames::CardResult;

namespace {

constexpr uint16_t kBehindSector = 512;  // a job of the card works in the bytes before
constexpr uint16_t kRestMs = 500;
constexpr uint8_t kLeastLength = 3;  // id, command, part
constexpr uint8_t kWriteLength = kLeastLength + frames::kCardPartBytes;
constexpr uint8_t kHead = 3;  // of an envelope: sync and length
constexpr uint8_t kCommandAt = kHead + 1;
constexpr uint8_t kPartAt = kHead + 2;
constexpr uint8_t kDataAt = kHead + 3;

struct Request {
  uint16_t heard_ms;
  uint8_t filled;
  uint8_t written;  // bytes of the EEPROM that the request asks for, so far
  bool writing;
  uint8_t bytes[kWriteLength + core::kEnvelopeOverhead];

  CardCommand command() const { return static_cast<CardCommand>(bytes[kCommandAt]); }
  uint8_t part() const { return bytes[kPartAt]; }
};

struct __attribute__((packed)) Answer {
  uint8_t command;
  uint8_t result;
  uint8_t part;
  uint32_t hash;
  uint8_t fault;
  uint8_t data[frames::kCardPartBytes];
};
constexpr uint8_t kShortAnswer = offsetof(Answer, data);
constexpr uint8_t kLongestEnvelope = sizeof(Answer) + 1 + core::kEnvelopeOverhead;

void send(const Answer& answer, uint8_t size) {
  core::send_envelope(
      [](const uint8_t* bytes, uint8_t count) { hal::send_bytes(hal::Port::kUsb, bytes, count); },
      frames::kCardAnswer,
      &answer,
      size);
}

void say(CardCommand command,
         CardResult result,
         uint8_t part,
         const TestInputs& inputs,
         CardFault fault = CardFault::kNone) {
  Answer answer;
  answer.command = static_cast<uint8_t>(command);
  answer.result = static_cast<uint8_t>(result);
  answer.part = part;
  answer.hash = inputs.rows() != 0 ? card_hash() : 0;
  answer.fault = static_cast<uint8_t>(fault);
  send(answer, kShortAnswer);
}

void say_part(uint8_t part, const TestInputs& inputs) {
  Answer answer;
  answer.command = static_cast<uint8_t>(CardCommand::kRead);
  answer.result = static_cast<uint8_t>(CardResult::kOk);
  answer.part = part;
  answer.hash = inputs.rows() != 0 ? card_hash() : 0;
  answer.fault = static_cast<uint8_t>(CardFault::kNone);
  read_card_part(part, answer.data);
  send(answer, sizeof answer);
}

// What stands against writing; kOk: nothing.
CardResult refusal(const PilotLink& pilot, core::FlightState flight) {
  const frames::Drive drive = pilot.drive();
  if (drive == frames::Drive::kMega || drive == frames::Drive::kMegaHolding ||
      hal::relay_engaged()) {
    return CardResult::kRelay;
  }
  return flight == core::FlightState::kGround ? CardResult::kOk : CardResult::kAirborne;
}

// True when the envelope is whole and good; a byte that cannot belong to one begins anew.
bool whole(Request* request) {
  const uint8_t* const bytes = request->bytes;
  const uint8_t filled = request->filled;
  const uint8_t length = bytes[2];
  const bool odd = bytes[0] != core::kEnvelopeSync0 ||
                   (filled > 1 && bytes[1] != core::kEnvelopeSync1) ||
                   (filled > 2 && length != kLeastLength && length != kWriteLength);
  if (odd) request->filled = 0;
  return !odd && filled > 2 && filled == length + core::kEnvelopeOverhead;
}

bool good(const Request& request) {
  const uint8_t length = request.bytes[2];
  const uint16_t crc =
      core::crc16(core::kCrc16Start, request.bytes + 2, static_cast<uint16_t>(length + 1U));
  const uint8_t command = request.bytes[kCommandAt];
  const bool writes = request.command() == CardCommand::kWrite;
  return request.bytes[kHead] == frames::kCardRequest &&
         request.bytes[kHead + length] == (crc & 0xFFU) &&
         request.bytes[kHead + length + 1] == crc >> 8 &&
         command >= static_cast<uint8_t>(CardCommand::kState) &&
         command <= static_cast<uint8_t>(CardCommand::kRead) &&
         length == (writes ? kWriteLength : kLeastLength) && request.part() < core::kCardParts;
}

// The next byte of a request that writes; true: all of them stand in the EEPROM.
bool written(Request* request) {
  const bool commits = request->command() == CardCommand::kCommit;
  if (!hal::eeprom_ready()) return false;
  if (request->written == 0) {
    hal::write_eeprom(kCardValidAddress, commits ? kCardValid : uint8_t{0});
    request->written = 1;
    return false;
  }
  const uint8_t count =
      request->command() == CardCommand::kWrite ? uint8_t{frames::kCardPartBytes} : uint8_t{0};
  const uint8_t at = static_cast<uint8_t>(request->written - 1U);
  if (at >= count) return true;
  hal::write_eeprom(static_cast<uint16_t>(card_part_address(request->part()) + at),
                    request->bytes[kDataAt + at]);
  ++request->written;
  return false;
}

bool reads_back(const Request& request) {
  const bool commits = request.command() == CardCommand::kCommit;
  if (card_marked_valid() != commits) return false;
  if (request.command() != CardCommand::kWrite) return true;
  for (uint8_t i = 0; i < frames::kCardPartBytes; ++i) {
    const uint16_t address = static_cast<uint16_t>(card_part_address(request.part()) + i);
    if (hal::read_eeprom(address) != request.bytes[kDataAt + i]) return false;
  }
  return true;
}

void say_state(const frames::ConfigFrame& config, const TestInputs& inputs) {
  if (inputs.rows() != 0) {
    say(CardCommand::kState, CardResult::kOk, 0, inputs);
    return;
  }
  const CardFault fault = card_marked_valid() ? judge_card(config.aircraft) : CardFault::kNotValid;
  say(CardCommand::kState, CardResult::kNoCard, 0, inputs, fault);
}

void obey(Request* request,
          const PilotLink& pilot,
          core::FlightState flight,
          const frames::ConfigFrame& config,
          TestInputs& inputs) {
  request->filled = 0;
  const CardCommand command = request->command();
  if (command == CardCommand::kState) {
    say_state(config, inputs);
    return;
  }
  if (command == CardCommand::kRead) {
    say_part(request->part(), inputs);
    return;
  }
  const CardResult against = refusal(pilot, flight);
  if (against != CardResult::kOk) {
    say(command, against, request->part(), inputs);
    return;
  }
  inputs.unload();
  if (command == CardCommand::kCommit) {
    const CardFault fault = judge_card(config.aircraft);
    if (fault != CardFault::kNone) {
      say(command, CardResult::kDamaged, 0, inputs, fault);
      return;
    }
  }
  request->writing = true;
  request->written = 0;
}

}  // namespace

void CardConsole::step(core::ByteRing& ring,
                       const PilotLink& pilot,
                       core::FlightState flight,
                       const frames::ConfigFrame& config,
                       TestInputs& inputs,
                       uint32_t now_us) {
  uint8_t* const lent = ring.lend();
  if (lent == nullptr) live_ = false;
  Request* const request =
      lent == nullptr ? nullptr : reinterpret_cast<Request*>(lent + kBehindSector);
  if (hal::send_room(hal::Port::kUsb) < kLongestEnvelope) return;
  if (live_ && request->writing) {
    if (!written(request)) return;
    request->writing = false;
    const bool stands = reads_back(*request);
    if (stands && request->command() == CardCommand::kCommit) inputs.load(config);
    say(request->command(),
        stands ? CardResult::kOk : CardResult::kEeprom,
        request->part(),
        inputs);
    return;
  }
  uint8_t byte;
  if (!hal::take_byte(hal::Port::kUsb, &byte)) return;
  if (request == nullptr) {
    say(CardCommand{}, CardResult::kRecording, 0, inputs);
    return;
  }
  const uint16_t now_ms = static_cast<uint16_t>(now_us >> 10);
  if (!live_ || static_cast<uint16_t>(now_ms - request->heard_ms) > kRestMs) {
    request->filled = 0;
    request->writing = false;
    live_ = true;
  }
  request->heard_ms = now_ms;
  request->bytes[request->filled++] = byte;
  if (!whole(request)) {
    say(CardCommand{}, request->filled == 0 ? CardResult::kRequest : CardResult::kMore, 0, inputs);
    return;
  }
  if (!good(*request)) {
    request->filled = 0;
    say(CardCommand{}, CardResult::kRequest, 0, inputs);
    return;
  }
  obey(request, pilot, flight, config, inputs);
}

}  // namespace app
