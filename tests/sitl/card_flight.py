"""Fly with a card: ten seconds on the ground, then throttle up; the Mega drives from 2 s on."""

from __future__ import annotations

from host.twin.recorder.sitl_library import TICKS_PER_S, Port, Recorder, Sitl

from tests.cards.judge import Judgement, judge, message_of
from tests.cards.sparse import SparseCard
from tests.cards.truth import look_at
from tests.sitl import still_aircraft
from tests.sitl.card_image import CARD_ID

MESSAGE_S = 10.0  # by then it is ready to record, or says why not
RECORDING_S = 12.0  # with throttle up from MESSAGE_S on
MARGIN_S = 5.0  # of stimuli, should a call take long


def fly(sitl: Sitl, card: SparseCard) -> Judgement:
    """Fly and judge.

    Parameters
    ----------
    sitl : Sitl
        An instrument that was just made.
    card : SparseCard
        Changed.
    """
    before, content = look_at(card), card.content()
    sitl.insert_card(card.image, CARD_ID)
    still_aircraft.give(sitl, RECORDING_S + MARGIN_S, throttle_up_s=MESSAGE_S)
    sitl.power_on()
    sitl.run_until(round(MESSAGE_S * TICKS_PER_S))
    message = message_of(sitl.sent(Port.USB))
    sitl.run_until(round(RECORDING_S * TICKS_PER_S))
    recording = Recorder(sitl.state().recorder) is Recorder.RECORDING
    noticed = still_aircraft.pilot_noticed(sitl)
    sitl.power_cut(1)
    sitl.close()
    judgement = judge(message, before, card, card.changed_since(content), recording=recording)
    judgement.wrong[:0] = noticed
    return judgement


def stay(sitl: Sitl, card: SparseCard, seconds: float) -> list[str]:
    """Stay on the ground with a card, then cut the power; gives what was said each second."""
    sitl.insert_card(card.image, CARD_ID)
    still_aircraft.give(sitl, seconds + MARGIN_S, throttle_up_s=seconds + MARGIN_S)
    sitl.power_on()
    said = []
    for second in range(1, round(seconds) + 1):
        sitl.run_until(second * TICKS_PER_S)
        said.append(message_of(sitl.sent(Port.USB)))
    noticed = still_aircraft.pilot_noticed(sitl)
    sitl.power_cut(1)
    sitl.close()
    return said + noticed
