;;; The tree of goals, and the life of its root.

(deffunction talk-leaf (?class $?name)
  "A goal without sub-goals; its id is the name, if any, and a number."
  (bind ?number (gensym*))
  (bind ?id (if (eq ?name (create$)) then ?number else (sym-cat (expand$ ?name) - ?number)))
  (assert (goal (class ?class) (id ?id))))

(deffunction talk-greet ()
  "Talk, and beside it do something that succeeds in the second of three tries."
  (goal-tree-assert-run-parallel AUTOMATIC-SUBGOAL NONE
    (talk-leaf TALK)
    (goal-tree-assert-retry AUTOMATIC-SUBGOAL 3 (talk-leaf SUCCEED-SECOND-TRY))))

(deffunction talk-attempts ()
  "Four attempts that come to nothing, each in its own way, and one that succeeds."
  (goal-tree-assert-try-all AUTOMATIC-SUBGOAL
    ;; five seconds for something that takes for ever
    (goal-tree-assert-timeout AUTOMATIC-SUBGOAL 5.0 (talk-leaf HANG-NOOP))
    ;; goes on after a rejection, and is rejected in the end
    (goal-tree-assert-run-parallel-delayed AUTOMATIC-SUBGOAL FAILED
      (talk-leaf ALWAYS-REJECT)
      (goal-tree-assert-run-parallel AUTOMATIC-SUBGOAL NONE
        (talk-leaf PRINT PARALLEL-PRINT)
        (talk-leaf PRINT PARALLEL-PRINT)))
    ;; does not go on after a failure
    (goal-tree-assert-run-parallel-delayed AUTOMATIC-SUBGOAL REJECTED
      (talk-leaf ALWAYS-FAIL)
      (talk-leaf PRINT NEVER-EXPANDED))
    (talk-leaf ALWAYS-FAIL)
    (talk-leaf PRINT FINALLY-SUCCEED)))

(defrule talk-begin
  "Once, as soon as the domain is there and the skiller obeys us."
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
  "Nothing is to be decided at the root: it goes from one mode to the next."
  ?root <- (goal (class TESTGOAL-PARENT) (mode ?mode&FORMULATED|SELECTED|FINISHED|EVALUATED))
  =>
  (bind ?modes (create$ FORMULATED SELECTED EXPANDED FINISHED EVALUATED RETRACTED))
  (modify ?root (mode (nth$ (+ 1 (member$ ?mode ?modes)) ?modes))))
