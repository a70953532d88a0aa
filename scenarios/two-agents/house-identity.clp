;;; The identity of the robot, from the configuration.

(defrule house-identity
  (wm-fact (id "/config/agent/name") (value ?name))
  =>
  (cx-identity-set (str-cat ?name)))
