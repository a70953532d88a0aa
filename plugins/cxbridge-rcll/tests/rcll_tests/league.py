"""A minimal league: a referee and an agent of a few rules each, and one machine."""

from __future__ import annotations

from pathlib import Path

MESSAGES = """
syntax = "proto2";
package llsf_msgs;
enum Team { CYAN = 0; MAGENTA = 1; }
message SetTeamName { enum CompType { COMP_ID = 2000; MSG_TYPE = 1; }
  required string team_name = 1; required Team team_color = 2; }
message SetGamePhase { enum CompType { COMP_ID = 2000; MSG_TYPE = 2; }
  enum Phase { PRE_GAME = 0; SETUP = 1; PRODUCTION = 2; POST_GAME = 3; } required Phase phase = 1; }
message SetGameState { enum CompType { COMP_ID = 2000; MSG_TYPE = 3; }
  enum State { WAIT_START = 0; RUNNING = 1; } required State state = 1; }
message GameState { enum CompType { COMP_ID = 2000; MSG_TYPE = 4; } required string phase = 1; }
message PrepareMachine { enum CompType { COMP_ID = 2000; MSG_TYPE = 5; } required string machine = 1; }
"""

REFEREE = """
(deftemplate confval (slot path) (slot type) (slot value) (slot is-list) (multislot list-value))
(deftemplate protobuf-msg (slot type) (slot comp-id) (slot msg-type) (slot rcvd-via) (multislot rcvd-from)
  (multislot rcvd-at) (slot client-type) (slot client-id) (slot ptr))
(deftemplate gamestate (slot phase (default PRE_GAME)) (multislot points (default 0 0)))
(deftemplate machine (slot name) (slot zone) (slot rotation (default 90)) (slot state (default IDLE)))
(deftemplate points (slot team) (slot points) (slot game-time) (slot phase) (slot reason))
(deftemplate order (slot id) (slot complexity) (slot active (default TRUE))
  (multislot delivery-period (default 0 60)))
(deftemplate product-processed (slot mtype) (slot order) (slot team) (slot game-time) (slot confirmed))
(deftemplate time-info (slot game-time (default 0.0)))
(defrule begin (init) => (load-config "/llsfrb") (mps-generator-start)
  (bind ?field (mps-generator-get-generated-field))
  (assert (gamestate) (time-info) (order (id 1) (complexity C0))
          (order (id 2) (complexity C3) (active FALSE)) (peer (pb-peer-create-local "x" 4444 4445))
          (machine (name C-BS) (zone (nth$ 2 ?field))))
  (reconfigure-machine C-BS))
(defrule phase
  ?m <- (protobuf-msg (type "llsf_msgs.SetGamePhase") (rcvd-via STREAM) (ptr ?p)) ?g <- (gamestate)
  => (retract ?m) (modify ?g (phase (pb-field-value ?p "phase"))))
(defrule prepare
  ?m <- (protobuf-msg (type "llsf_msgs.PrepareMachine") (ptr ?p)) (gamestate (phase PRODUCTION))
  => (retract ?m) (mps-bs-dispense (pb-field-value ?p "machine") "BASE_RED"))
(defrule ready ?f <- (mps-status-feedback ?m READY TRUE) ?machine <- (machine (name ?m))
  => (retract ?f) (modify ?machine (state READY-AT-OUTPUT)))
(defrule dispensed ?f <- (mps-status-feedback ?m BUSY FALSE) (not (moved ?m))
  => (retract ?f) (assert (moved ?m)) (mps-move-conveyor ?m "OUTPUT" "FORWARD"))
(defrule taken ?f <- (mps-status-feedback ?m READY FALSE) ?g <- (gamestate (points ?c ?o))
  ?machine <- (machine (name ?m))
  => (retract ?f) (modify ?g (points (+ ?c 5) ?o)) (modify ?machine (state IDLE))
  (assert (points (team CYAN) (points 5) (game-time 1.0) (phase PRODUCTION) (reason "Taken at C-BS"))
          (product-processed (mtype DS) (order 1) (team CYAN) (game-time 1.0) (confirmed TRUE))))
(defrule tell (time $?) (gamestate (phase ?phase)) (peer ?peer)
  => (bind ?m (pb-create "llsf_msgs.GameState")) (pb-set-field ?m "phase" ?phase)
  (pb-broadcast ?peer ?m) (pb-destroy ?m))
(defrule tick (declare (salience -9000)) ?t <- (time $?) => (retract ?t))
(defrule message (declare (salience -4000)) ?m <- (protobuf-msg) => (retract ?m))
(reset)
"""

REFEREE_CONFIG = """
llsfrb:
  comm: {server-port: 4444}
  mps: {stations: {C-BS: {connection: mockup}}}
"""

TEAM = """
fawkes:
  agent: {team: Ours}
  bbsync: {peers: {robot1: {active: false}, elsewhere: {active: false}}}
clips-executive:
  assert-time-each-loop: true
  spec: team
  clips-dirs: ["@BASEDIR@/src/clips-specs"]
  specs:
    team:
      init:
        stage-1: [{name: protobuf}]
        stage-3: [{name: agent, file: team.clp}]
      action-mapping: {fetch: 'manipulate_wp{mps="C-BS", side="OUTPUT", target="WORKPIECE"}'}
"""

AGENT = """
(defrule team-begin (executive-initialized) (not (peer ?)) =>
  (blackboard-open "SkillerInterface" "/robot1/Skiller")
  (assert (peer (pb-peer-create-local "y" 4445 4444))))
(defrule team-control (SkillerInterface (id "/robot1/Skiller") (exclusive_controller "")) (not (asked)) =>
  (assert (asked))
  (blackboard-send-msg (blackboard-create-msg "SkillerInterface::/robot1/Skiller" "AcquireControlMessage")))
(defrule team-prepare (protobuf-msg (type "llsf_msgs.GameState") (ptr ?p)) (peer ?peer) (not (prepared))
  (test (eq (pb-field-value ?p "phase") "PRODUCTION")) =>
  (assert (prepared))
  (bind ?m (pb-create "llsf_msgs.PrepareMachine")) (pb-set-field ?m "machine" "C-BS")
  (pb-broadcast ?peer ?m) (pb-destroy ?m))
(defrule team-fetch (prepared) (not (sent)) =>
  (assert (sent))
  (bind ?m (blackboard-create-msg "SkillerInterface::/robot1/Skiller" "ExecSkillMessage"))
  (blackboard-set-msg-field ?m "skill_string" "moveto{place=\\"C-BS-OUTPUT\\"}")
  (blackboard-send-msg ?m))
(defrule team-take (sent) (SkillerInterface (id "/robot1/Skiller") (status S_FINAL)) (not (taking)) =>
  (assert (taking))
  (bind ?m (blackboard-create-msg "SkillerInterface::/robot1/Skiller" "ExecSkillMessage"))
  (blackboard-set-msg-field ?m "skill_string"
    "manipulate_wp{mps=\\"C-BS\\", side=\\"OUTPUT\\", target=\\"WORKPIECE\\"}")
  (blackboard-send-msg ?m))
(defrule team-broken (nobody ?x) => (printout t ?unbound crlf))
"""


def write_refbox(folder: Path, rules: str = REFEREE) -> Path:
    """Write the checkout of a referee; return its folder."""
    (folder / "src/games/rcll").mkdir(parents=True)
    (folder / "src/games/rcll/init.clp").write_text(rules)
    (folder / "cfg/mps").mkdir(parents=True)
    (folder / "cfg/mps/default_mps.yaml").write_text(REFEREE_CONFIG)
    messages = folder / "src/msgs/rcll-protobuf-msgs"
    messages.mkdir(parents=True)
    (messages / "league.proto").write_text(MESSAGES)
    return folder


def write_team(folder: Path, agent: str = AGENT) -> Path:
    """Write the checkout of a team; return its folder."""
    (folder / "cfg/rcll-simulator").mkdir(parents=True)
    (folder / "cfg/rcll-simulator/central_agent.yaml").write_text(TEAM)
    (folder / "src/clips-specs").mkdir(parents=True)
    (folder / "src/clips-specs/team.clp").write_text(agent)
    return folder
