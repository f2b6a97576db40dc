"""Faults of events are reported with all others."""

from __future__ import annotations

import pytest

import symdyn as sd


def ball(planar: bool = True) -> tuple[sd.System, object, object]:
    y = sd.coordinates("y")
    m, g = sd.parameters("m g")
    s = sd.System("ball", gravity=[0, -g] if planar else [0, -g, 0])
    body = s.add_body("ball", mass=m)
    s.add_joint(sd.Prismatic("fall", s.ground, body, y, axis=[0, 1] if planar else [0, 1, 0]))
    return s, body, y


def test_every_fault_of_an_event() -> None:
    s, body, y = ball()
    m = sd.parameters("m")
    s.add_event("two words", m, direction=2, stop=True, reset={m: 1})
    s.add_event("strange", "y", stop=1, reset=[y])
    s.add_event("deep", sd.position(body)[2])
    s.add_event("deep", sd.position("bell")[0])
    with pytest.raises(sd.ModelError) as caught:
        s.check()
    text = "\n".join(caught.value.faults)
    for fault in ("event 'two words': direction is 2; pass 1 (upwards through zero), -1 (downwards) or 0 (either way)",
                  "event 'two words' has stop=True and a reset, which nothing would follow",
                  "an event is named 'two words'; pass an identifier such as 'lands'",
                  "event 'two words' is m, which stays the same all the time",
                  "event 'two words' resets m; only coordinates, speeds and states can be reset: y, y_dot",
                  "event 'strange' is the text 'y'; text is never evaluated", "event 'strange': stop is 1; pass True or False",
                  "event 'strange': reset is [y]; pass a dict such as {v: -e*v}",
                  "event 'deep' uses position(ball)[2], which is zero in a planar system; "
                  "components there are [0], [1]", "2 events are named 'deep'",
                  "event 'deep': body of position(bell)[0] is 'bell', which is no body of the system; bodies: ground, "
                  "ball; did you mean 'ball'?"):
        assert fault in text, (fault, text)


def test_third_component_of_space() -> None:
    s, body, _ = ball(planar=False)
    s.add_event("aside", sd.position(body, [0, 0, 1])[2] - sd.t)
    eq = s.embedding()
    assert eq.explicit("events").tolist() == [[1 - sd.t]]


def test_what_is_no_expression_is_one_fault() -> None:
    x = sd.coordinates("x")
    for value in (x > 1, "x"):
        system = sd.System("ball", gravity=[0, -9.81])
        body = system.add_body("ball", 1)
        system.add_joint(sd.Prismatic("fall", "ground", body, x, axis=[0, 1]))
        system.add_event("e", value)
        with pytest.raises(sd.ModelError) as caught:
            system.check()
        assert len(caught.value.faults) == 1
