def test_the_cup_is_delivered(cx):
    run = cx.run("courier")
    run.to_end()
    run.assert_outcomes(DELIVER="COMPLETED")
    assert [call.name for call in run.skills.calls] == ["goto", "pick", "goto", "put"]
    assert run.facts("domain-fact", name="at", param_values=("cup", "table"))
    run.assert_golden()


def test_a_lost_grip_is_tried_again(cx):
    run = cx.run("courier")
    run.skills("pick").fails("slipped", after=0.5, times=1).succeeds(after=2.0)
    run.to_end()
    run.assert_outcomes(DELIVER="COMPLETED")
    assert [call.name for call in run.skills.calls] == ["goto", "pick", "pick", "goto", "put"]


def test_after_three_tries_it_gives_up(cx):
    run = cx.run("courier")
    run.skills("pick").fails("slipped")
    run.to_end()
    run.assert_outcomes(DELIVER="FAILED")
    assert len(run.skills("pick").calls) == 3


def test_a_cup_that_is_carried_away_meanwhile(cx):
    run = cx.run("courier")
    run.at(0.5, lambda: run.retract("domain-fact", name="at", param_values=("cup", "kitchen")))
    run.to_end()
    run.assert_outcomes(DELIVER="FAILED")
    assert [call.name for call in run.skills.calls] == ["goto"]
