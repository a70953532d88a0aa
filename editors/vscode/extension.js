// Starts `cxbridge lsp` for CLIPS files, and `cxbridge dap` for launch configurations of the type cxbridge.
"use strict";

const path = require("path");
const vscode = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

const NAME = "cxbridge";

let client;

/** The program that the settings name, and the folder that it works in. */
function program(folder) {
  const command = vscode.workspace.getConfiguration(NAME, folder).get("command", NAME);
  const cwd = folder?.fsPath;
  const isRelative = command.includes("/") && !path.isAbsolute(command);
  return { command: isRelative && cwd ? path.join(cwd, command) : command, cwd };
}

function firstFolder() {
  return vscode.workspace.workspaceFolders?.[0]?.uri;
}

async function startServer() {
  if (!vscode.workspace.isTrusted || !vscode.workspace.getConfiguration(NAME).get("languageServer", true)) {
    return;
  }
  const { command, cwd } = program(firstFolder());
  const server = { command, args: ["lsp"], options: { cwd } };
  const files = "**/*.{clp,pddl,lua,yaml,xml}";
  client = new LanguageClient(NAME, "cxbridge", server, {
    documentSelector: [
      { scheme: "file", language: "clips" },
      { scheme: "file", pattern: "**/*.pddl" },
      { scheme: "file", pattern: "**/scenario.yaml" },
    ],
    synchronize: { fileEvents: vscode.workspace.createFileSystemWatcher(files) },
  });
  try {
    await client.start();
  } catch (error) {
    client = undefined;
    const choice = await vscode.window.showErrorMessage(
      `'${command} lsp' does not start: ${error.message}`,
      "Open settings",
    );
    if (choice) {
      await vscode.commands.executeCommand("workbench.action.openSettings", `${NAME}.command`);
    }
  }
}

async function stopServer() {
  const running = client;
  client = undefined;
  await running?.stop();
}

const adapters = {
  createDebugAdapterDescriptor(session) {
    const { command, cwd } = program(session.workspaceFolder?.uri ?? firstFolder());
    return new vscode.DebugAdapterExecutable(command, ["dap"], { cwd });
  },
};

const configurations = {
  // F5 in a CLIPS file without a launch.json: the scenario of the folder that it is in
  resolveDebugConfiguration(folder, config) {
    if (config.type || config.request || config.name) {
      return config;
    }
    const editor = vscode.window.activeTextEditor;
    if (editor?.document.languageId !== "clips") {
      return config;
    }
    const scenario = path.dirname(editor.document.uri.fsPath);
    return { type: NAME, request: "launch", name: path.basename(scenario), scenario };
  },
  resolveDebugConfigurationWithSubstitutedVariables(folder, config) {
    return folder && !config.cwd ? { ...config, cwd: folder.uri.fsPath } : config;
  },
};

async function activate(context) {
  context.subscriptions.push(
    vscode.debug.registerDebugAdapterDescriptorFactory(NAME, adapters),
    vscode.debug.registerDebugConfigurationProvider(NAME, configurations),
    vscode.commands.registerCommand(`${NAME}.restartServer`, async () => {
      await stopServer();
      await startServer();
    }),
    vscode.workspace.onDidGrantWorkspaceTrust(startServer),
  );
  await startServer();
}

module.exports = { activate, deactivate: stopServer };
