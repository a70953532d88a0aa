; Modules, focus, auto-focus, salience as an expression, logical support, retraction, defaults.

(defmodule MAIN (export ?ALL))
(deftemplate MAIN::task (slot id) (slot state (default open)) (multislot needs))
(deffacts MAIN::start (task (id a)) (task (id b) (needs a)) (task (id c) (needs a b)) (tool hammer))
(defglobal ?*high* = 10)

(defrule MAIN::begin (declare (salience 100)) => (printout t "begin" crlf) (focus CHECK WORK))
(defrule MAIN::end (declare (salience -10)) (not (task (state open))) => (printout t "end" crlf))

(defmodule CHECK (import MAIN ?ALL))
(defrule CHECK::all-known
  (forall (task (needs $? ?n $?)) (task (id ?n)))
  => (printout t "all needs are known" crlf))
(defrule CHECK::tools (exists (tool ?)) => (printout t "there are tools" crlf))
(defrule CHECK::logic (logical (tool ?x)) => (assert (ready ?x)) (printout t "ready with " ?x crlf))
(deftemplate CHECK::ready-note (slot x))

(defmodule WORK (import MAIN ?ALL))
(defrule WORK::do
  (declare (salience (+ ?*high* 1)))
  ?t <- (task (id ?id) (state open) (needs $?needs))
  (not (task (id ?n&:(member$ ?n ?needs)) (state open)))
  =>
  (printout t "doing " ?id " needs " ?needs crlf)
  (modify ?t (state done)))
(defrule WORK::break-tool
  (declare (salience 5))
  (task (id b) (state done))
  ?tool <- (tool hammer)
  => (printout t "the hammer breaks" crlf) (retract ?tool))
(defrule WORK::alarm (declare (auto-focus TRUE)) (alarm ?why) => (printout t "alarm " ?why crlf))
(defrule WORK::raise (declare (salience 1)) (task (id c) (state done)) => (assert (alarm late)) (printout t "raised" crlf))
