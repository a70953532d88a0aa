// Messages of an interface: those that were sent, and a form to send one.
import { part, post } from "cx/api.js";
import { clockText, el } from "cx/dom.js";

const MOST = 20;
let chosenMessage = ""; // stays when another interface was looked at

/** An interface's id as a part of an address. */
export const idPath = (id) => id.split("/").map(part).join("/");

/** The messages that were sent to an interface, the latest first; nothing when there are none. */
export function sentMessages(app, uid) {
  const mine = app.model.messages
    .filter((each) => each.uid === uid)
    .slice(-MOST)
    .reverse();
  if (!uid || !mine.length) return [];
  const rows = mine.map((each) =>
    el.li(
      el("span.dim.n", clockText(each.time, 3)),
      el.b(each.message),
      el("code.main-text", JSON.stringify(each.values)),
      el("span.dim.small", [each.sender, each.outcome].join(" ")),
    ),
  );
  return [el.h3("Messages"), el("ol.calls", rows)];
}

function inputOf(field) {
  if (field.enums.length) return el.select(field.enums.map((item) => el.option(item)));
  if (field.type === "bool" && !field.is_array) return el.input({ type: "checkbox" });
  if (field.is_array) return el.input({ type: "text", placeholder: "1, 2, 3" });
  if (field.type === "string") return el.input({ type: "text" });
  return el.input({ type: "number", step: /float|double/.test(field.type) ? "any" : "1", value: "0" });
}
function convert(field, text) {
  if (field.enums.length || field.type === "string") return text;
  if (field.type === "bool") return text === "true" || text === "1";
  return Number(text);
}
function valueOf(field, input) {
  if (field.is_array)
    return input.value
      .split(",")
      .filter((each) => each.trim())
      .map((each) => convert(field, each.trim()));
  if (input.type === "checkbox") return input.checked;
  return convert(field, input.value);
}
const fieldLabel = (field, input) =>
  el.label(el.span(field.name, el("span.dim.small", " " + field.type + (field.is_array ? "[]" : ""))), input);

/** The form of a message: an input a field, by its type; null when the interface takes none. */
export function messageForm(app, of) {
  const types = of.message_types;
  if (app.recording || !types.length) return null;
  if (!types.some((each) => each.name === chosenMessage)) chosenMessage = types[0].name;
  const choice = el.select(
    { "aria-label": "message" },
    types.map((each) => el.option({ value: each.name, selected: each.name === chosenMessage }, each.name)),
  );
  const fields = el("div.fields");
  let inputs = new Map();
  function drawFields() {
    const type = types.find((each) => each.name === chosenMessage);
    inputs = new Map(type.fields.map((field) => [field, inputOf(field)]));
    fields.replaceChildren(...[...inputs].map(([field, input]) => fieldLabel(field, input)));
  }
  choice.addEventListener("change", () => {
    chosenMessage = choice.value;
    drawFields();
  });
  const form = el(
    "form#message.message",
    el.h3("Send a message"),
    choice,
    fields,
    el(
      "div.tools",
      app.gate(el("button.primary", { type: "submit" }, "Send")),
      app.whyNot ? el("span.dim.small", app.whyNot) : null,
    ),
  );
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const values = [...inputs].map(([field, input]) => [field.name, valueOf(field, input)]),
      type = chosenMessage;
    app.attempt(async () => {
      const answer = await post("cxbridge/blackboard/" + part(of.type) + "/" + idPath(of.id) + "/messages", {
        type,
        fields: Object.fromEntries(values),
      });
      app.toast(type + " sent, number " + answer.msgid);
    });
  });
  drawFields();
  return form;
}
