// Messages of an interface: the sent messages, and a form.
import { escapePart, idPath, post } from "cx/api.js";
import { choice, clockText, el, form, gatedSubmit, refill, textInput } from "cx/dom.js";

const MOST_MESSAGES = 20; // of the list
let chosenMessage = ""; // a type of messages; kept while other interfaces are shown

/** The messages that were sent to an interface, the latest first. */
export function sentMessages(app, uid) {
  const messages = app.model.messages.filter((message) => message.uid === uid).slice(-MOST_MESSAGES);
  if (!uid || !messages.length) return [];
  const row = ({ time, message, values, sender, outcome }) =>
    el.li(
      el("span.dim.n", clockText(time, 3)),
      el.b(message),
      el("code.main-text", JSON.stringify(values)),
      el("span.dim.small", sender + " " + outcome),
    );
  return [el.h3("Messages"), el("ol.calls", messages.reverse().map(row))];
}

const isCheckbox = ({ type, is_array: isArray }) => type === "bool" && !isArray;
function inputOf(field) {
  if (field.enums.length) return el.select(field.enums.map((item) => el.option(item)));
  if (isCheckbox(field)) return el.input({ type: "checkbox" });
  if (field.is_array || field.type === "string")
    return textInput({ placeholder: field.is_array ? "1, 2, 3" : null });
  return el.input({ type: "number", step: /int|byte/.test(field.type) ? "1" : "any", value: "0" });
}
/** The JSON value of a text that was typed for a field, or for an element of an array. */
function convert({ enums, type }, text) {
  if (enums.length || type === "string") return text;
  return type === "bool" ? text === "true" || text === "1" : Number(text);
}
/** The JSON value of a field's input. The elements of an array are separated by commas. */
function valueOf(field, { checked, value }) {
  if (isCheckbox(field)) return checked;
  if (!field.is_array) return convert(field, value);
  const texts = value.split(",").map((element) => element.trim());
  return texts.filter(Boolean).map((text) => convert(field, text));
}
const labelled = ({ name, type, is_array: isArray }, input) =>
  el.label(el.span(name, el("span.dim.small", " " + type + (isArray ? "[]" : ""))), input);

/** The form for a message, with an input for each field; null in a recording, and without message types. */
export function messageForm(app, { type: interfaceType, id, message_types: types }) {
  if (app.recording || !types.length) return null;
  if (!types.some((type) => type.name === chosenMessage)) chosenMessage = types[0].name;
  const fields = el("div.fields");
  let inputs = []; // pairs of field and input
  function show(name) {
    chosenMessage = name;
    inputs = types.find((type) => type.name === name).fields.map((field) => [field, inputOf(field)]);
    refill(
      fields,
      inputs.map(([field, input]) => labelled(field, input)),
    );
  }
  const select = choice({ "aria-label": "message" }, show);
  const send = () => {
    const type = chosenMessage,
      values = inputs.map(([field, input]) => [field.name, valueOf(field, input)]);
    app.attempt(async () => {
      const path = "cxbridge/blackboard/" + escapePart(interfaceType) + "/" + idPath(id) + "/messages",
        answer = await post(path, { type, fields: Object.fromEntries(values) });
      app.toast(type + " sent, number " + answer.msgid);
    });
  };
  const names = types.map(({ name }) => name);
  select.offer(names, chosenMessage);
  show(chosenMessage);
  return form("#message.message", send, el.h3("Send a message"), select, fields, gatedSubmit(app, "Send"));
}
