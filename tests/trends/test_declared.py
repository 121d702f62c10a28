"""An event as it is listed, against its own file."""

from dataclasses import replace

import numpy as np
import pytest

from asflown.trends.entries import declared
from asflown.trends.entries.events import Event
from asflown.trends.entries.figures import Actuation, Torque
from flights import CASSINI, changed, flown

MECHANISM = CASSINI.mechanisms[0]
SOUND = Event("a", "deploy", "2015-09-29T00:01:00", None, 60.0, 450.0)


def said(event=SOUND, tlm=None, torque=None):
    tlm = tlm or flown("cover-deploy", noise="none").telemetry
    torque = torque or Torque(np.arange(480.0) - 60, np.zeros(480))
    return [d.kind for d in declared.contradictions(event, tlm, Actuation(tlm, event, MECHANISM), torque)]


def test_a_sound_event_is_left_in_peace():
    assert said() == []


@pytest.mark.parametrize(
    ("event", "kind"),
    [
        (replace(SOUND, motor_on_s=30.0), declared.ANGLE_APART),
        (replace(SOUND, motor_on_s=90.0), declared.START_APART),
        (replace(SOUND, date="2005-09-29T00:01:00"), declared.DATE_APART),
    ],
)
def test_recovery_what_is_listed_wrongly_is_said(event, kind):
    assert said(event) == [kind]


def test_recovery_a_record_in_which_nothing_moves_is_said():
    still = changed(
        flown("cover-deploy", noise="none").telemetry, "cover_angle", lambda c: replace(c, values=0 * c.values)
    )
    assert said(tlm=still) == [declared.NOTHING_MOVES]
