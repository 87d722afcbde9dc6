// Three rows of one flight on the simulated AVR (flight_on_chip.py writes its cases.h).
#include "replay.h"

TEST_CASE("pitch: every bit of the host's, at every solve of the row") {
  replay::run_case(&cases::kPitchCard,
                   cases::kPitchWorth,
                   cases::kPitchRows,
                   cases::kPitchSamples,
                   cases::kPitchSolves,
                   cases::kPitchSums);
}

TEST_CASE("roll: every bit of the host's, at every solve of the row") {
  replay::run_case(&cases::kRollCard,
                   cases::kRollWorth,
                   cases::kRollRows,
                   cases::kRollSamples,
                   cases::kRollSolves,
                   cases::kRollSums);
}

TEST_CASE("yaw: every bit of the host's, at every solve of the row") {
  replay::run_case(&cases::kYawCard,
                   cases::kYawWorth,
                   cases::kYawRows,
                   cases::kYawSamples,
                   cases::kYawSolves,
                   cases::kYawSums);
}
