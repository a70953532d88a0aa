;;; To try skills by hand: (assert (start)) makes a plan of two skills, and each change of
;;; an action is told.

(defrule start
  (start)
  =>
  (printout t "Spec starting" crlf)
  (progn$ (?text (create$ "Hello world" "Good bye"))
    (assert (plan-action (id ?text-index) (plan-id foo) (duration 4.0) (action-name say)
                         (param-names text wait) (param-values ?text true)))))

(defrule done
  (plan-action (id ?id) (state ?state))
  =>
  (printout t "Action " ?id " is now " ?state crlf))
