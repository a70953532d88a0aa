// Starts `cxbridge lsp` for CLIPS files, and `cxbridge dap` for launch configurations of the type cxbridge.
"use strict";

const fs = require("fs");
const path = require("path");
const vscode = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

const NAME = "cxbridge";

let client; // the client of the running language server; undefined without a server

/**
 * Find a program: a path is absolute or relative to a folder; a name is searched in PATH and in the folder's
 * .venv. Returns undefined for a missing program.
 */
function findProgram(command, cwd) {
  const ownFolders = cwd ? [cwd, path.join(cwd, ".venv", "bin"), path.join(cwd, ".venv", "Scripts")] : [];
  const isPath = /[\\/]/.test(command);
  const folders = isPath
    ? ownFolders.slice(0, 1)
    : [...(process.env.PATH ?? "").split(path.delimiter), ...ownFolders.slice(1)];
  const names = process.platform === "win32" ? [`${command}.exe`, command] : [command];
  const paths =
    isPath && path.isAbsolute(command)
      ? names
      : folders.flatMap((folder) => names.map((name) => path.join(folder, name)));
  return paths.find((candidate) => fs.existsSync(candidate));
}

/** The configured program: its name, its path `command` (undefined without a program), its working folder. */
function configuredProgram(folder) {
  const name = vscode.workspace.getConfiguration(NAME, folder).get("command", NAME);
  return {
    name,
    command: findProgram(name, folder?.fsPath),
    cwd: folder?.fsPath,
  };
}

/** Show an error with a button that opens the setting of the program. */
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
  const { name, command, cwd } = configuredProgram(firstFolder());
  if (!command) {
    void complainOfMissing(name); // not awaited: the message stays until the user closes it
    return;
  }
  const server = { command, args: ["lsp"], options: { cwd } };
  const watchedFiles = "**/*.{clp,pddl,lua,yaml,xml}";
  client = new LanguageClient(NAME, "cxbridge", server, {
    documentSelector: [
      { scheme: "file", language: "clips" },
      { scheme: "file", pattern: "**/*.pddl" },
      { scheme: "file", pattern: "**/scenario.yaml" },
    ],
    synchronize: {
      fileEvents: vscode.workspace.createFileSystemWatcher(watchedFiles),
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
  const runningClient = client;
  client = undefined;
  await runningClient?.stop();
}

const adapterFactory = {
  createDebugAdapterDescriptor(session) {
    const { command, cwd } = configuredProgram(session.workspaceFolder?.uri ?? firstFolder());
    return new vscode.DebugAdapterExecutable(command, ["dap"], { cwd });
  },
};

const configurationProvider = {
  // F5 in a CLIPS file without a launch.json starts the scenario in the folder of the file
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
    const { name, command } = configuredProgram(folder?.uri ?? firstFolder());
    if (!command) {
      void complainOfMissing(name); // VS Code itself would show no error
      return undefined;
    }
    return folder && !config.cwd ? { ...config, cwd: folder.uri.fsPath } : config;
  },
};

async function activate(context) {
  context.subscriptions.push(
    vscode.debug.registerDebugAdapterDescriptorFactory(NAME, adapterFactory),
    vscode.debug.registerDebugConfigurationProvider(NAME, configurationProvider),
    vscode.commands.registerCommand(`${NAME}.restartServer`, async () => {
      await stopServer();
      await startServer();
    }),
    vscode.workspace.onDidGrantWorkspaceTrust(startServer),
  );
  await startServer();
}

module.exports = { activate, deactivate: stopServer };
