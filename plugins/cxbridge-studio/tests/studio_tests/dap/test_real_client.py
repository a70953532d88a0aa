"""The debug adapter with the client of VS Code's tests of debug adapters."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys

import pytest

from studio_tests.dap.conftest import GOALS, find_line
from tests.support import ROOT

EXTENSION = ROOT / "editors" / "vscode"
PACKAGE = EXTENSION / "node_modules" / "@vscode" / "debugadapter-testsupport"

pytestmark = pytest.mark.skipif(
    shutil.which("node") is None or not PACKAGE.is_dir(),
    reason="there is no node, or 'make editor' has not installed the packages of editors/vscode",
)

SESSION = """
const { DebugClient } = require("@vscode/debugadapter-testsupport");
const options = JSON.parse(process.argv[1]);
const client = new DebugClient(options.python, options.arguments, "cxbridge", { cwd: options.cwd });
const result = { log: [] };

// a short form of the protocol for the page on VS Code
const formatRequest = {
  setBreakpoints: (args) => `line ${args.breakpoints.map((each) => each.line).join(", ") || "(none)"}`,
  stackTrace: () => "",
  scopes: () => "",
  evaluate: (args) => args.expression,
  next: () => "",
  continue: () => "",
};
const line = (each) => (each.line ? `, line ${each.line}` : "");
const formatResponse = {
  setBreakpoints: (body) =>
    body.breakpoints.map((each) => `verified: ${each.verified}${line(each)}, ${each.message}`),
  stackTrace: (body) => body.stackFrames.map((each) => `${each.name}${line(each)}`),
  scopes: (body) => [body.scopes.map((each) => each.name).join(", ")],
  evaluate: (body) => [body.result],
};
const send = client.send.bind(client);
client.send = async (command, args) => {
  if (command in formatRequest) result.log.push(`-> ${command} ${formatRequest[command](args)}`.trim());
  const response = await send(command, args);
  if (command in formatResponse)
    result.log.push(...formatResponse[command](response.body).map((each) => `<-   ${each}`));
  return response;
};
client.on("stopped", (event) =>
  result.log.push(`<- stopped (${event.body.reason}): ${event.body.description}`),
);
client.on("terminated", () => result.log.push("<- terminated"));

async function debug() {
  await client.hitBreakpoint(
    { scenario: options.scenario },
    { path: options.file, line: options.line },
    { path: options.file, line: options.rule },
    { path: options.file, line: options.rule, verified: true },
  );
  const stack = await client.stackTraceRequest({ threadId: 1 });
  result.stack = stack.body.stackFrames.map((frame) => frame.name);
  const scopes = await client.scopesRequest({ frameId: stack.body.stackFrames[0].id });
  const reference = scopes.body.scopes[0].variablesReference;
  const variables = await client.variablesRequest({ variablesReference: reference });
  result.variables = variables.body.variables.map((each) => each.name);
  result.value = (await client.evaluateRequest({ expression: "?mode", context: "hover" })).body.result;
  await client.evaluateRequest({ expression: "(goal (class TALK) (mode ?m))", context: "repl" });
  await Promise.all([client.nextRequest({ threadId: 1 }), client.waitForEvent("stopped")]);
  await client.setBreakpointsRequest({ source: { path: options.file }, breakpoints: [] });
  await Promise.all([client.continueRequest({ threadId: 1 }), client.waitForEvent("terminated")]);
}

client
  .start()
  .then(debug)
  .then(() => client.stop())
  .then(() => console.log(JSON.stringify(result)))
  .catch((error) => {
    console.error(error);
    process.exit(1);
  });
"""


def run_session(**options):
    options |= {"python": sys.executable, "arguments": "", "cwd": str(ROOT)}
    # the client starts "RUNTIME FILE" without further arguments
    adapter_file = options.pop("adapter_file")
    options["arguments"] = str(adapter_file)
    process = subprocess.run(
        ["node", "-e", SESSION, json.dumps(options)],
        capture_output=True,
        text=True,
        cwd=EXTENSION,
        timeout=120,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    return json.loads(process.stdout.splitlines()[-1])


@pytest.fixture(name="adapter_file")
def _starter(tmp_path):
    file = tmp_path / "adapter.py"
    file.write_text("from cxbridge.cli.main import main\nmain(['dap'])\n")
    return file


def test_vscode_client_debugs_run(adapter_file):
    rule = find_line(GOALS, "(defrule talk-root-goes-on")
    result = run_session(
        adapter_file=adapter_file, scenario="test-scenario", file=str(GOALS), line=rule, rule=rule
    )
    assert result["stack"][0] == "talk-root-goes-on"
    assert result["stack"][1].endswith("(TESTGOAL-PARENT): FORMULATED")
    assert result["variables"] == ["?root", "?mode"]
    assert result["value"] == "FORMULATED"
    page = (ROOT / "docs" / "evidence" / "editors.md").read_text().partition("## The debug adapter")[2]
    shown = page.partition("```text\n")[2].partition("```")[0]
    assert shown.splitlines() == result["log"]
