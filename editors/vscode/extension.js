// Starts `cxbridge lsp` for CLIPS files, and `cxbridge dap` for launch configurations of the type cxbridge.
"use strict";

const fs = require("fs");
const path = require("path");
const vscode = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

const NAME = "cxbridge";

let client;

/** Where a program is: a path as it is or seen from a folder, a name in the PATH or in the folder's .venv. */
function find(command, cwd) {
  const own = cwd ? [cwd, path.join(cwd, ".venv", "bin"), path.join(cwd, ".venv", "Scripts")] : [];
  const isPath = /[\\/]/.test(command);
  const folders = isPath
    ? own.slice(0, 1)
    : [...(process.env.PATH ?? "").split(path.delimiter), ...own.slice(1)];
  const names = process.platform === "win32" ? [`${command}.exe`, command] : [command];
  const paths =
    isPath && path.isAbsolute(command)
      ? names
      : folders.flatMap((each) => names.map((name) => path.join(each, name)));
  return paths.find((each) => fs.existsSync(each));
}

/** The program that the settings name, and the folder that it works in; no program where there is none. */
function program(folder) {
  const command = vscode.workspace.getConfiguration(NAME, folder).get("command", NAME);
  return {
    name: command,
    command: find(command, folder?.fsPath),
    cwd: folder?.fsPath,
  };
}

/** Says why something does not start, and leads to the setting. */
async function complain(message) {
  if (await vscode.window.showErrorMessage(message, "Open settings")) {
    await vscode.commands.executeCommand("workbench.action.openSettings", `${NAME}.command`);
  }
}

function complainOfMissing(name) {
  const where = vscode.env.remoteName ? " on the remote machine" : "";
  return complain(`There is no program '${name}'${where}. The setting cxbridge.command names it.`);
}

function firstFolder() {
  return vscode.workspace.workspaceFolders?.[0]?.uri;
}

async function startServer() {
  if (!vscode.workspace.isTrusted || !vscode.workspace.getConfiguration(NAME).get("languageServer", true)) {
    return;
  }
  const { name, command, cwd } = program(firstFolder());
  if (!command) {
    void complainOfMissing(name);
    return;
  }
  const server = { command, args: ["lsp"], options: { cwd } };
  const files = "**/*.{clp,pddl,lua,yaml,xml}";
  client = new LanguageClient(NAME, "cxbridge", server, {
    documentSelector: [
      { scheme: "file", language: "clips" },
      { scheme: "file", pattern: "**/*.pddl" },
      { scheme: "file", pattern: "**/scenario.yaml" },
    ],
    synchronize: {
      fileEvents: vscode.workspace.createFileSystemWatcher(files),
    },
  });
  try {
    await client.start();
  } catch (error) {
    client = undefined;
    void complain(`'${command} lsp' does not start: ${error.message}`);
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
    return {
      type: NAME,
      request: "launch",
      name: path.basename(scenario),
      scenario,
    };
  },
  resolveDebugConfigurationWithSubstitutedVariables(folder, config) {
    const { name, command } = program(folder?.uri ?? firstFolder());
    if (!command) {
      void complainOfMissing(name); // VS Code itself would say nothing
      return undefined;
    }
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
