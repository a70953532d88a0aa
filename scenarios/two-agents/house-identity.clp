;;; Who we are: what the configuration says.

(defrule house-identity
  (wm-fact (id "/config/agent/name") (value ?name))
  =>
  (cx-identity-set (str-cat ?name)))
