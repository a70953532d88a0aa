;;; The tree of goals, and the modes of its root.

(deffunction talk-leaf (?class $?name)
  "Assert a goal without sub-goals. Its id is the name, if there is a name, and a number."
  (bind ?number (gensym*))
  (bind ?id (if (eq ?name (create$)) then ?number else (sym-cat (expand$ ?name) - ?number)))
  (assert (goal (class ?class) (id ?id))))

(deffunction talk-greet ()
  "Talk, and at the same time pursue a goal that completes in the second of three tries."
  (goal-tree-assert-run-parallel AUTOMATIC-SUBGOAL NONE
    (talk-leaf TALK)
    (goal-tree-assert-retry AUTOMATIC-SUBGOAL 3 (talk-leaf SUCCEED-SECOND-TRY))))

(deffunction talk-attempts ()
  "Four goals that fail for different reasons, and one that completes."
  (goal-tree-assert-try-all AUTOMATIC-SUBGOAL
    ;; a timeout of five seconds for a goal that never ends
    (goal-tree-assert-timeout AUTOMATIC-SUBGOAL 5.0 (talk-leaf HANG-NOOP))
    ;; continues after a rejection, and is rejected
    (goal-tree-assert-run-parallel-delayed AUTOMATIC-SUBGOAL FAILED
      (talk-leaf ALWAYS-REJECT)
      (goal-tree-assert-run-parallel AUTOMATIC-SUBGOAL NONE
        (talk-leaf PRINT PARALLEL-PRINT)
        (talk-leaf PRINT PARALLEL-PRINT)))
    ;; does not continue after a failure
    (goal-tree-assert-run-parallel-delayed AUTOMATIC-SUBGOAL REJECTED
      (talk-leaf ALWAYS-FAIL)
      (talk-leaf PRINT NEVER-EXPANDED))
    (talk-leaf ALWAYS-FAIL)
    (talk-leaf PRINT FINALLY-SUCCEED)))

(defrule talk-begin
  "Formulate the root once, when the domain is loaded and the skiller is controlled."
  (domain-loaded)
  (domain-facts-loaded)
  (skiller-control (acquired TRUE))
  (not (test-performed))
  (not (goal))
  =>
  (goal-tree-assert-run-one TESTGOAL-PARENT
    (talk-leaf ALWAYS-REJECT)
    (goal-tree-assert-run-all AUTOMATIC-SUBGOAL (talk-greet) (talk-attempts)))
  (assert (test-performed)))

(defrule talk-root-goes-on
  "The root needs no decisions: advance it to its next mode."
  ?root <- (goal (class TESTGOAL-PARENT) (mode ?mode&FORMULATED|SELECTED|FINISHED|EVALUATED))
  =>
  (bind ?modes (create$ FORMULATED SELECTED EXPANDED FINISHED EVALUATED RETRACTED))
  (modify ?root (mode (nth$ (+ 1 (member$ ?mode ?modes)) ?modes))))
