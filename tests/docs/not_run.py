# ruff: noqa: E501 - commands are in one line, as they stand on their page
"""The commands of the manual that our tests do not run, each with the reason.

Commands in a ``console`` block are run. All further lines that look like commands have to be here.
"""

from __future__ import annotations

CI_ITSELF = "is what .ci/run runs"
SAME = "is run by these tests, in another spelling"
ROBOT = "needs a robot's Fawkes; done by hand with a real one"
TWO_MACHINES = "needs a second machine; tests/hosts does the same in two network namespaces"
MONGODB = "needs MongoDB"
ROOT_RIGHTS = "needs root or systemd"
DOCKER = "needs docker"
INDEX = "installs from a package index; tests/test_packaging.py does the same with a wheel"
TERMINAL = "is what plugins/cxbridge-ros2/tests/ros2_tests/experts/test_terminal.py does"
HOME = "writes into the user's home"
OWN_FILES = "needs files of the reader's own robot"
RCLL = "needs the RCLL agent's checkout; plugins/cxbridge-rcll/tests/rcll_tests/test_specs.py does the same"
TODAYS_CX = "needs a checkout of clips_executive; plugins/cxbridge-ros2cx/tests does the same"
THESIS = "needs a checkout of ros2-clips-executive; plugins/cxbridge-ros2cx/tests does the same"
WEB = "opens a browser and serves the page until Ctrl-C; tests/cli/test_web_page.py does the same"
FUZZING = "takes an hour, and a compiler; the tests replay what it found"
OPENSSL = "needs openssl"
PAIRS = "needs public collections of PDDL, VAL and half an hour"
SWEEP = "is what plugins/cxbridge-explore/tests/explore_tests/sweep/test_command.py does with fewer runs"

NOT_RUN: dict[str, dict[str, str]] = {
    "README.md": {
        "make run": CI_ITSELF,
        "make test": CI_ITSELF,
        ".venv/bin/python -m pip install -e plugins/cxbridge-explore": INDEX,
        ".venv/bin/cxbridge run test-scenario --web": WEB,
    },
    "configuration.md": {
        "cxbridge check rcll-simulator/central_agent.yaml --overlay ~/fawkes-robotino --fawkes-dir ~/fawkes": RCLL,
    },
    "daemon.md": {
        "cxbridge gateway tcp://127.0.0.1:1911 fawkes://robot:1910 -i SkillerInterface -i SkillerDebugInterface": ROBOT,
    },
    "evidence/clips.md": {
        "cxbridge run ~/fawkes-robotino/cfg --fawkes-dir ~/fawkes --spec rcll-central --config mine.yaml --clips-dir ~/fawkes-robotino/src/clips-specs --interface-dir ~/fawkes-robotino/src/libs/interfaces": RCLL,
    },
    "evidence/dependencies.md": {
        "make lock": INDEX,
    },
    "evidence/planning.md": {
        "python -m benchmarks.planner_pairs FOLDER... --most 5 --draw 110 --timeout 30 --engines --validate VAL/bin/Validate": PAIRS,
    },
    "evidence/rcll.md": {
        "cxbridge game --fawkes-dir fawkes --overlay corrections --overlay fawkes-robotino --refbox-dir rcll-refbox --spec rcll-central --seed 1 --simtest FULL": "plugins/cxbridge-rcll/tests/rcll_tests/test_league.py does it",
        "cxbridge game --fawkes-dir fawkes --overlay fawkes-robotino --refbox-dir rcll-refbox --spec rcll --seed 1 --json": "plugins/cxbridge-rcll/tests/rcll_tests/test_league.py does it",
        "cxbridge game --fawkes-dir fawkes --overlay corrections --overlay fawkes-robotino --refbox-dir rcll-refbox --spec rcll-central --seed 1 --json": "is what plugins/cxbridge-rcll/tests/rcll_tests/test_league.py does",
        "cxbridge explore --fawkes-dir fawkes --overlay corrections --overlay fawkes-robotino --refbox-dir rcll-refbox --spec rcll-central --seed 1 --minutes 4 --faults 1 --depth 30": "takes ten minutes",
    },
    "evidence/replay.md": {},
    "evidence/ros2-cx.md": {
        "cxbridge run my_agent/params/agent.yaml --ros2cx ~/clips_executive --timeout 60 --log-dir out": TODAYS_CX,
    },
    "evidence/ros2cx.md": {
        "cxbridge run --ros2cx ~/ros2-clips-executive --spec test-nav2": THESIS,
        "cxbridge run --ros2cx ~/ros2-clips-executive --config goals": THESIS,
        "cxbridge run --ros2cx ~/ros2-clips-executive --spec test-nav2 --executor move=robot.py:Move": THESIS,
        "cxbridge run --ros2cx ~/ros2-clips-executive --spec test-nav2 --executor move=cxbridge_ros2cx.executors:MoveExecutor": THESIS,
        "cxbridge run --ros2cx ~/ros2-clips-executive --spec test-skill --timeout 5 --trace skill.mcap --executor move=robot.py:Move --executor move=robot.py:Move": THESIS,
        "cxbridge trace exchange skill.mcap": THESIS,
        "cxbridge daemon --ros2cx ~/ros2-clips-executive --spec test-nav2 --config elsewhere.yaml": THESIS,
        "cxbridge skill executor cxbridge_ros2cx.executors:MoveExecutor --agent default": THESIS,
        "cxbridge run --ros2cx ~/ros2-clips-executive --spec test-nav2 --trace nav2.mcap": THESIS,
        "cxbridge trace extract nav2.mcap 'pddl/*'": THESIS,
        "cxbridge trace report nav2.mcap": THESIS,
        "cxbridge run --ros2cx ~/ros2-clips-executive --config goals --config skiller --clock real": ROBOT,
        "cxbridge run --ros2cx ~/ros2-clips-executive --spec test-pddl --config skiller --clock real": ROBOT,
    },
    "evidence/security.md": {
        "pip install atheris": FUZZING,
        "python -m fuzz zmq corpus-zmq -max_total_time=3600 -max_len=8192": FUZZING,
        "python -m fuzz zmq-sessions corpus-sessions -max_total_time=3600 -max_len=600 -timeout=20": FUZZING,
        "python -m fuzz fawkesnet corpus-fawkesnet -max_total_time=3600 -max_len=8192": FUZZING,
        "python -m fuzz skill-strings corpus-skills -max_total_time=3600 -max_len=400 -timeout=20 -rss_limit_mb=1500": FUZZING,
        "python -m fuzz ros2-cdr corpus-cdr -max_total_time=3600 -max_len=4096 -rss_limit_mb=1500": FUZZING,
        "python -m fuzz.minimise zmq-sessions corpus-sessions tests/blackboard/zmq/corpus_sessions": FUZZING,
    },
    "explore.md": {
        "cxbridge explore test-scenario --faults 2": "is what plugins/cxbridge-explore/tests/explore_tests/test_explore.py does",
        "cxbridge explore two-robots --faults 2 --html out/explore/map.html": "plugins/cxbridge-explore/tests/explore_tests/test_map.py writes a map",
    },
    "from-fawkes.md": {
        "cxbridge run --fawkes-dir ~/fawkes --overlay ~/fawkes-robotino --spec rcll": RCLL,
        "cxbridge run ~/robot/cfg --fawkes-dir ~/fawkes --spec robot --clips-dir ~/robot/clips --interface-dir ~/robot/interfaces": OWN_FILES,
    },
    "from-ros2.md": {
        "cxbridge run my_agent/params/agent.yaml --ros2cx ~/clips_executive --timeout 60 --log-dir out": TODAYS_CX,
    },
    "games.md": {
        "cp -r scenarios/workshop mine": "the agent is then changed by hand",
        "cxbridge game workshop --against mine --games 20": "is what plugins/cxbridge-explore/tests/explore_tests/game/test_game.py does with fewer games",
        "cxbridge sweep courier --against courier-v2 --runs 1000": SWEEP,
        "cxbridge sweep courier --runs 50000 --seed 0 --csv out/first.csv": SWEEP,
        "cxbridge sweep courier --runs 50000 --seed 50000 --csv out/second.csv": SWEEP,
        "cxbridge game --fawkes-dir fawkes --overlay fawkes-robotino --refbox-dir rcll-refbox --spec rcll-central --seed 1 --minutes 4": "plugins/cxbridge-rcll/tests/rcll_tests/test_league.py does it",
    },
    "installing.md": {
        ". .venv/bin/activate": SAME,
        "pip install ~/cxbridge": INDEX,
        "pip install dist/cxbridge-0.2.0-py3-none-any.whl": INDEX,
        "cxbridge --install-completion": HOME,
        "useradd --system cxbridge": ROOT_RIGHTS,
        "python3 -m venv /opt/cxbridge && /opt/cxbridge/bin/pip install cxbridge": ROOT_RIGHTS,
        "cp share/systemd/cxbridge.service /etc/systemd/system/": ROOT_RIGHTS,
        "systemctl enable --now cxbridge": ROOT_RIGHTS,
        "docker build -t cxbridge .": DOCKER,
        'docker run --rm --network host -v "$PWD/robot.yaml:/etc/cxbridge/robot.yaml:ro" cxbridge daemon /etc/cxbridge/robot.yaml': DOCKER,
        "docker run --rm cxbridge run test-scenario": DOCKER,
    },
    "recording.md": {
        "cxbridge trace record --connect fawkes://robot:1910 -i '*' -o logs/ --duration 60 --json": ROBOT,
        "cxbridge trace replay logs/ --connect fawkes://robot:1910 -i 'Laser360Interface'": ROBOT,
        "cxbridge trace replay run.mcap -i 'Position3DInterface::*' --from 10 --to 20 --speed 0.5 --loop": OWN_FILES,
    },
    "ros2.md": {
        "pip install 'cxbridge[ros2]'": INDEX,
        "cxbridge trace convert run.mcap run-bag --to rosbag": "is what plugins/cxbridge-ros2/tests/ros2_tests/bags does",
        "cxbridge ros2 terminal": TERMINAL,
        "cxbridge ros2 terminal get problem predicates": TERMINAL,
        "cxbridge ros2 terminal < commands.txt": TERMINAL,
    },
    "security.md": {
        "cxbridge keys robot -o ~/.cxbridge": HOME,
        "cxbridge keys laptop -o ~/.cxbridge": HOME,
        "cxbridge daemon --endpoint tcp://10.77.0.1:1911 --secret-key ~/.cxbridge/robot.key_secret --clients ~/.cxbridge/clients": TWO_MACHINES,
        'cxbridge run scenarios/test-scenario --skiller "tcp://10.77.0.1:1911?key=$HOME/.cxbridge/laptop.key_secret&server-key=$HOME/.cxbridge/robot.key"': TWO_MACHINES,
        "openssl rand -hex 24": OPENSSL,
        "openssl req -x509 -newkey rsa:3072 -nodes -days 365 -subj /CN=robot -keyout web.key -out web.crt": OPENSSL,
    },
    "several-agents.md": {
        "mongod --replSet robots --port 27021 --dbpath /var/lib/robots --bind_ip 127.0.0.1": MONGODB,
        "mongosh --port 27021 --eval 'rs.initiate()'": MONGODB,
        "cxbridge daemon scenarios/two-agents --agent robot2 --config fleet.yaml": MONGODB,
        "cxbridge run scenarios/two-agents --agent robot1 --clock real --config fleet.yaml": MONGODB,
    },
    "skill-board.md": {
        'cxbridge skill executor mover.py:Mover --agent robot1 --connect "tcp://base:1911?key=robot1.key_secret&server-key=base.key"': TWO_MACHINES,
    },
    "skiller.md": {
        "cxbridge run test-scenario --skiller fawkes://robot:1910 --trace robot.mcap": ROBOT,
    },
    "testing.md": {
        "pip install cxbridge pytest": INDEX,
        "pytest --cx-artifacts kept --junit-xml tests.xml": SAME,
    },
    "tutorial-agent.md": {
        ". .venv/bin/activate": SAME,
        "mkdir ~/cup && cd ~/cup": SAME,
    },
}
"""Page below docs, command, reason."""
