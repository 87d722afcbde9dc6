// The relay that gives the servos to the Mega, and the proof of life that holds it.
#pragma once

namespace hal {

// Turns the heartbeat line over. The charge pump behind it holds the relay while this is called at
// least every 10 ms and lets go within 50 ms after the last call, whatever the level. Main loop
// only, and only while every task has run.
void toggle_heartbeat();

// True while the spare contact shows the relay engaged: the Mega drives the servos. Main loop only.
bool relay_engaged();

}  // namespace hal
