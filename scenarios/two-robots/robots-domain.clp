;;; The domain model, and the Skillers of the robots.

(deftemplate robot "A robot, and the goal that it works for."
  (slot name (type SYMBOL))   ; the name in the domain
  (slot agent (type STRING))  ; the name on the skill board, and of its Skiller
  (slot goal (type SYMBOL) (default nil)))

(defglobal
  ?*PLACES* = (create$ kitchen office lab store))

(defrule robots-domain-load
  (executive-init)
  (not (domain-loaded))
  =>
  (parse-pddl-domain (path-resolve "domain.pddl"))
  (assert (domain-loaded)))

(defrule robots-domain-facts
  "Each robot is at its dock; request control of its Skiller."
  (executive-init)
  (domain-loaded)
  =>
  (progn$ (?robot (create$ robot1 robot2))
    (bind ?dock (nth$ ?robot-index (create$ dock1 dock2)))
    (bind ?agent (str-cat ?robot))
    (blackboard-open-reading "SkillerInterface" ?agent)
    (assert (robot (name ?robot) (agent ?agent))
            (skiller-control (skiller ?agent))
            (domain-fact (name at) (param-values ?robot ?dock))))
  (assert (domain-facts-loaded)))
