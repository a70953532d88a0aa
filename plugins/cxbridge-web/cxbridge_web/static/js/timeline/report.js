// What reports on recorded runs take from the page: cxbridge/trace/report makes one file of it.
import { durationText } from "../dom.js";
import { OUTCOMES, actionOutcome, goalOutcome, outcomeBadge, skillOutcome } from "../outcome.js";
import { History, lastUpTo } from "./history.js";
import { partsOf, pathOf } from "./path.js";
import { outcomeAt } from "./spans.js";
import { Timeline } from "./timeline.js";

Object.assign(cx, {
  History,
  OUTCOMES,
  Timeline,
  actionOutcome,
  durationText,
  goalOutcome,
  lastUpTo,
  outcomeAt,
  outcomeBadge,
  partsOf,
  pathOf,
  skillOutcome,
});
