;;; The world model: facts with the two kinds of names, and a mirror of the goals.

(defrule talk-world-facts
  (executive-init)
  =>
  ;; by id: the core adds the key
  (progn$ (?id (create$ "/domain/fact/person-in-front?name=Peter"
                        "/domain/fact/location?robot=R-1&place=C-BS"
                        "/domain/fact/holding?object=some-obj&robot=R-2"
                        "/wm/loaded?robot=R-1&objects=foo,bar"
                        "/wm/loaded?objects=foo2,bar2&robot=R-2"))
    (assert (wm-fact (id ?id) (value TRUE))))
  ;; by key: the core adds the id, even if a list is not closed
  (assert
    (wm-fact (value TRUE) (key domain fact loctest args? robot R-1 place X))
    (wm-fact (value TRUE) (key wm loaded args? robot R-1 objects [ cup plate ]))
    (wm-fact (value TRUE) (key wm loaded-order args? objects [ cup plate ] robot R-1))
    (wm-fact (value TRUE) (key wm broken args? robot R-1 objects [ cup plate )))
  ;; the identity of the agent
  (assert (wm-fact (value "executive") (key cx identity))))

(defrule talk-world-location
  (wm-fact (value TRUE) (key domain fact location args? robot ?robot place ?place))
  =>
  (printout error "Robot " ?robot " is at " ?place crlf))

;; ---- the world model has a fact for each goal, with its present state

(defrule talk-world-mirror-goal
  ?goal <- (goal (id ?id))
  =>
  (do-for-all-facts ((?mirror wm-fact)) (eq ?mirror:key (create$ template fact goal args? id ?id))
    (retract ?mirror))
  (assert-template-wm-fact ?goal id (deftemplate-remaining-slots goal id)))

(defrule talk-world-goal-is-gone
  ?mirror <- (wm-fact (key template fact goal args? id ?id))
  (not (goal (id ?id)))
  =>
  (retract ?mirror))
