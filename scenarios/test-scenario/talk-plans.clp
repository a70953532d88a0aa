;;; Plans: fixed in this scenario; a planner could make them, too.

(deffunction talk-step (?goal ?step ?action ?names ?values)
  "Assert an action of the goal's plan; its id is ten times ?step."
  (assert (plan-action (goal-id ?goal) (plan-id (sym-cat ?goal -PLAN)) (id (* 10 ?step))
                       (action-name ?action) (duration 4.0)
                       (param-names ?names) (param-values ?values))))

(defrule talk-plan-for-talk
  (goal (id ?goal) (class TALK) (mode SELECTED))
  =>
  (assert (plan (goal-id ?goal) (id (sym-cat ?goal -PLAN)) (type SEQUENTIAL)))
  (talk-step ?goal 1 say-hello (create$ name) (create$ peggy))
  (talk-step ?goal 2 print (create$ severity text) (create$ warn "This is a print test"))
  ;; the operator adds the names of the parameters
  (talk-step ?goal 3 say-goodbye (create$) (create$ peggy))
  (talk-step ?goal 4 say-hello-again (create$ name) (create$ peggy))
  (talk-step ?goal 5 say-cleanup (create$) (create$)))

(defrule talk-plan-for-print
  (goal (id ?goal) (class PRINT) (mode SELECTED))
  =>
  (assert (plan (goal-id ?goal) (id (sym-cat ?goal -PLAN)) (type SEQUENTIAL)))
  (progn$ (?text (create$ "something" "something else"))
    (talk-step ?goal ?text-index print (create$ severity text)
               (create$ warn (str-cat ?goal " prints " ?text)))))
