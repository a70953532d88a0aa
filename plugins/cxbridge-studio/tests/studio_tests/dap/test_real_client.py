"""The debug adapter with a client that we did not write: that of VS Code's own tests of debug adapters."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys

import pytest

from studio_tests.dap.conftest import GOALS, line_of
from tests.support import ROOT

EXTENSION = ROOT / "editors" / "vscode"
PACKAGE = EXTENSION / "node_modules" / "@vscode" / "debugadapter-testsupport"

pytestmark = pytest.mark.skipif(
    shutil.which("node") is None or not PACKAGE.is_dir(),
    reason="there is no node, or 'make editor' has not installed the packages of editors/vscode",
)

SESSION = """
const { DebugClient } = require("@vscode/debugadapter-testsupport");
const given = JSON.parse(process.argv[1]);
const client = new DebugClient(given.python, given.arguments, "cxbridge", { cwd: given.cwd });
const told = { log: [] };

// the protocol in short: what the page on VS Code shows
const asked = {
  setBreakpoints: (args) => `line ${args.breakpoints.map((each) => each.line).join(", ") || "(none)"}`,
  stackTrace: () => "",
  scopes: () => "",
  evaluate: (args) => args.expression,
  next: () => "",
  continue: () => "",
};
const line = (each) => (each.line ? `, line ${each.line}` : "");
const answered = {
  setBreakpoints: (body) =>
    body.breakpoints.map((each) => `verified: ${each.verified}${line(each)}, ${each.message}`),
  stackTrace: (body) => body.stackFrames.map((each) => `${each.name}${line(each)}`),
  scopes: (body) => [body.scopes.map((each) => each.name).join(", ")],
  evaluate: (body) => [body.result],
};
const send = client.send.bind(client);
client.send = async (command, args) => {
  if (command in asked) told.log.push(`-> ${command} ${asked[command](args)}`.trim());
  const answer = await send(command, args);
  if (command in answered) told.log.push(...answered[command](answer.body).map((each) => `<-   ${each}`));
  return answer;
};
client.on("stopped", (event) =>
  told.log.push(`<- stopped (${event.body.reason}): ${event.body.description}`),
);
client.on("terminated", () => told.log.push("<- terminated"));

async function live() {
  await client.hitBreakpoint(
    { scenario: given.scenario },
    { path: given.file, line: given.line },
    { path: given.file, line: given.rule },
    { path: given.file, line: given.rule, verified: true },
  );
  const stack = await client.stackTraceRequest({ threadId: 1 });
  told.stack = stack.body.stackFrames.map((frame) => frame.name);
  const scopes = await client.scopesRequest({ frameId: stack.body.stackFrames[0].id });
  const reference = scopes.body.scopes[0].variablesReference;
  const variables = await client.variablesRequest({ variablesReference: reference });
  told.variables = variables.body.variables.map((each) => each.name);
  told.value = (await client.evaluateRequest({ expression: "?mode", context: "hover" })).body.result;
  await client.evaluateRequest({ expression: "(goal (class TALK) (mode ?m))", context: "repl" });
  await Promise.all([client.nextRequest({ threadId: 1 }), client.waitForEvent("stopped")]);
  await client.setBreakpointsRequest({ source: { path: given.file }, breakpoints: [] });
  await Promise.all([client.continueRequest({ threadId: 1 }), client.waitForEvent("terminated")]);
}

client
  .start()
  .then(live)
  .then(() => client.stop())
  .then(() => console.log(JSON.stringify(told)))
  .catch((error) => {
    console.error(error);
    process.exit(1);
  });
"""


def session(**given):
    given |= {"python": sys.executable, "arguments": "", "cwd": str(ROOT)}
    # it starts "RUNTIME FILE", and takes no further arguments
    starter = given.pop("starter")
    given["arguments"] = str(starter)
    done = subprocess.run(
        ["node", "-e", SESSION, json.dumps(given)],
        capture_output=True,
        text=True,
        cwd=EXTENSION,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.fixture(name="starter")
def _starter(tmp_path):
    file = tmp_path / "adapter.py"
    file.write_text("from cxbridge.cli.main import main\nmain(['dap'])\n")
    return file


def test_it_debugs_a_run(starter):
    rule = line_of(GOALS, "(defrule talk-root-goes-on")
    told = session(starter=starter, scenario="test-scenario", file=str(GOALS), line=rule, rule=rule)
    assert told["stack"][0] == "talk-root-goes-on"
    assert told["stack"][1].endswith("(TESTGOAL-PARENT): FORMULATED")
    assert told["variables"] == ["?root", "?mode"]
    assert told["value"] == "FORMULATED"
    page = (ROOT / "docs" / "evidence" / "editors.md").read_text().partition("## The debug adapter")[2]
    shown = page.partition("```text\n")[2].partition("```")[0]
    assert shown.splitlines() == told["log"]
