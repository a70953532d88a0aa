;;; For trying skills by hand, without goals and a domain. (assert (start)) executes two
;;; actions, one after the other; each change of an action is printed. The spec needs a
;;; mapping for the action say, with the parameters text and wait. The rules start and done
;;; have Fawkes' names; the plan foo, the texts and the planned durations are Fawkes', too.

(defrule start
  "Formulate the two actions. Their plan is foo, without a plan fact."
  (start)
  =>
  (printout t "Spec starting" crlf)
  (assert (skiller-control))
  (progn$ (?text (create$ "Hello world" "Good bye"))
    (assert (plan-action (id ?text-index) (plan-id foo) (duration 4.0) (action-name say)
                         (param-names text wait) (param-values ?text true)))))

(defrule exectest-select-next-action
  "Select the next action, as action selection does for plans of goals."
  ?next <- (plan-action (plan-id foo) (state FORMULATED) (id ?id))
  (not (plan-action (plan-id foo) (state FORMULATED) (id ?earlier&:(< ?earlier ?id))))
  (not (plan-action (plan-id foo) (state PENDING|WAITING|RUNNING)))
  =>
  (modify ?next (state PENDING) (executable TRUE)))

(defrule done
  "Print each state of each action, not only the last one."
  (plan-action (id ?id) (state ?state))
  =>
  (printout t "Action " ?id " is now " ?state crlf))
