"""The tools that run an agent, which need ``--allow``."""

from __future__ import annotations

from cxbridge_mcp.commands import run_command
from cxbridge_mcp.folders import Folders
from cxbridge_mcp.recordings import clean_answer


class ProgramTools:
    """The tools that run agents as child processes.

    :param folders: the files that the assistant may name.
    """

    def __init__(self, folders: Folders) -> None:
        self._folders = folders

    async def run(self, scenario: str, recording: str, limit: float = 600.0, patience: float = 120.0) -> str:
        """Run an agent headless, and record the run with its facts.

        :param scenario: a name or path from list_scenarios.
        :param recording: the file to create, NAME.mcap; goal_tree, why_in_recording and compare_recordings
            read it.
        :param limit: the time limit in seconds of the run's clock.
        :param patience: the time limit in seconds of real time.
        """
        file = self._folders.new_recording_path(recording)
        arguments = [
            self._folders.scenario_argument(scenario),
            "--quiet",
            "--trace",
            str(file),
            "--trace-level",
            "facts",
        ]
        _, output = await run_command("run", *arguments, "--timeout", str(limit), timeout_s=patience)
        return clean_answer(output)

    async def explore(
        self,
        scenario: str,
        faults: int = 1,
        properties: list[str] | None = None,
        patience: float = 300.0,
    ) -> str:
        """Run an agent in every way that its world allows with a limited number of faults.

        The answer names the violated properties, each with the shortest run that violates it.

        :param scenario: a name or path from list_scenarios.
        :param faults: the maximum number of faults in a run.
        :param properties: names or forms of properties; by default the properties of the scenario and the
            built-in properties.
        :param patience: the time limit in seconds of real time.
        """
        arguments = [self._folders.scenario_argument(scenario), "--faults", str(faults)]
        arguments += [f"--property={text}" for text in properties or ()]
        _, output = await run_command("explore", *arguments, timeout_s=patience)
        return clean_answer(output)
