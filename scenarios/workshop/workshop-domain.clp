;;; The domain model, and the robots and machines of the workshop.

(deftemplate robot "A robot, and the goal that it works for."
  (slot name (type SYMBOL))   ; the name in the domain; its text is the name on the skill board
  (slot goal (type SYMBOL) (default nil)))

(deftemplate machine "A machine, and the order for which it is reserved."
  (slot name (type SYMBOL))
  (slot order (type SYMBOL) (default nil)))

(defrule workshop-domain-load
  (executive-init)
  (not (domain-loaded))
  =>
  (parse-pddl-domain (path-resolve "domain.pddl"))
  (assert (domain-loaded)))

(defrule workshop-domain-facts
  "The robots are at their docks, the machines are empty."
  (executive-init)
  (domain-loaded)
  =>
  (progn$ (?robot (create$ robot1 robot2))
    (assert (robot (name ?robot))
            (domain-fact (name at) (param-values ?robot (sym-cat dock ?robot-index)))))
  (progn$ (?machine (create$ saw booth counter))
    (assert (machine (name ?machine))))
  (assert (domain-facts-loaded)))
