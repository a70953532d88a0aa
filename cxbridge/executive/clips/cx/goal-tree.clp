;;; Functions that build trees of goals. Children are fact addresses, as
;;; (assert (goal ...)) and the functions below return them:
;;;
;;;   (goal-tree-assert-run-all TIDY-UP
;;;     (assert (goal (class PICK)))
;;;     (goal-tree-assert-retry PLACE-AGAIN 3 (assert (goal (class PLACE)))))

(deffunction goal-tree-update-child (?goal ?parent-id ?priority)
  "Set the parent and the priority of a goal. A goal without an id gets <class>-genN."
  (bind ?id (fact-slot-value ?goal id))
  (if (eq ?id nil) then
    (bind ?id (sym-cat (fact-slot-value ?goal class) - (gensym*))))
  (cx-modify-goal ?goal (id ?id) (parent ?parent-id) (priority ?priority)))

(deffunction goal-tree-own-copies (?children)
  "The children, with a copy for each repetition. Equal goals without an id are one fact, but
   a caller that lists the fact twice wants two goals. Goals with an id are not copied."
  (bind ?goals (create$))
  (progn$ (?child ?children)
    (bind ?goal ?child)
    (if (and (member$ ?child ?goals) (eq nil (fact-slot-value ?child id))) then
      (bind ?goal (duplicate ?child (id (sym-cat (fact-slot-value ?child class) - (gensym*))))))
    (bind ?goals ?goals ?goal))  ; bind makes a list of several values
  ?goals)

(deffunction goal-tree-assert (?prefix ?class ?sub-type ?params ?first-priority ?children)
  "Assert the goal <prefix>-<class>-genN, update its children, and return the goal. The first child
   gets ?first-priority, each further child one less, but at least zero. So all children have the same
   priority if ?first-priority is 0."
  (bind ?id (sym-cat ?prefix - ?class - (gensym*)))
  (bind ?goal
    (assert (goal (id ?id) (class ?class) (sub-type ?sub-type) (params ?params))))
  (progn$ (?child (goal-tree-own-copies ?children))
    (goal-tree-update-child ?child ?id (max 0 (- ?first-priority (- ?child-index 1)))))
  ?goal)

(deffunction goal-tree-assert-run-one (?class $?fact-addresses)
  "Assert and return a goal that pursues its children one after the other until a child is not rejected."
  (goal-tree-assert RUN-ONE ?class RUN-ONE-OF-SUBGOALS (create$)
                    (length$ ?fact-addresses) ?fact-addresses))

(deffunction goal-tree-assert-run-all (?class $?fact-addresses)
  "Assert and return a goal that pursues all its children one after the other; the first child that does
   not complete ends the goal."
  (goal-tree-assert RUN-ALL ?class RUN-ALL-OF-SUBGOALS (create$)
                    (length$ ?fact-addresses) ?fact-addresses))

(deffunction goal-tree-assert-try-all (?class $?fact-addresses)
  "Assert and return a goal that pursues its children one after the other until a child completes."
  (goal-tree-assert TRY-ALL ?class TRY-ALL-OF-SUBGOALS (create$)
                    (length$ ?fact-addresses) ?fact-addresses))

(deffunction goal-tree-assert-retry (?class ?max-tries ?fact-address)
  "Assert and return a goal that pursues its child again until the child completes, at most ?max-tries times."
  (goal-tree-assert RETRY ?class RETRY-SUBGOAL (create$ max-tries ?max-tries)
                    0 (create$ ?fact-address)))

(deffunction goal-tree-assert-timeout (?class ?timeout ?fact-address)
  "Assert and return a goal that pursues its child. After ?timeout seconds, the child fails unless it has
   finished or holds resources."
  (goal-tree-assert TIMEOUT ?class TIMEOUT-SUBGOAL (create$ timeout ?timeout)
                    0 (create$ ?fact-address)))

(deffunction goal-tree-parallel-params (?continue-on)
  "The parameters of a run-parallel goal; an unknown option means NONE."
  (if (not (member$ ?continue-on (create$ FAILED REJECTED NONE))) then
    (printout warn "ignoring unrecognized option " ?continue-on " for run-parallel goal, "
                   "expected FAILED|REJECTED|NONE, using default: NONE" crlf)
    (bind ?continue-on NONE))
  (create$ continue-on ?continue-on))

(deffunction goal-tree-assert-run-parallel (?class ?continue-on $?fact-addresses)
  "Assert and return a goal that pursues all its children at once. After a child is rejected
   or has failed, children that have not begun are rejected, unless ?continue-on is REJECTED
   (continue after rejections) or FAILED (continue after both)."
  (goal-tree-assert PARALLEL ?class RUN-SUBGOALS-IN-PARALLEL
                    (goal-tree-parallel-params ?continue-on) 0 ?fact-addresses))

(deffunction goal-tree-assert-run-parallel-delayed (?class ?continue-on $?fact-addresses)
  "As goal-tree-assert-run-parallel, but each child waits until the children before it are dispatched."
  (goal-tree-assert PARALLEL ?class RUN-SUBGOALS-IN-PARALLEL
                    (goal-tree-parallel-params ?continue-on)
                    (length$ ?fact-addresses) ?fact-addresses))
