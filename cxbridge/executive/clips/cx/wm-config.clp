;;; Configuration in the world model: parameters of the spec below /config, values of
;;; the agent below /config/agent.

(deffunction wm-config-assert (?from ?to)
  "Assert a wm-fact for each configured value below the path ?from. In the id, ?to replaces this
   path."
  (bind ?begin (+ 1 (str-length ?from)))
  (do-for-all-facts ((?conf confval)) (str-prefix (str-cat ?from "/") ?conf:path)
    (assert (wm-fact (id (str-cat ?to (sub-string ?begin (str-length ?conf:path) ?conf:path)))
                     (type ?conf:type) (value ?conf:value)
                     (is-list ?conf:is-list) (values ?conf:list-value)))))

(defrule wm-config-load-from-confval
  (executive-init)
  =>
  (do-for-all-facts ((?spec confval)) (eq ?spec:path "/clips-executive/spec")
    (wm-config-assert (str-cat "/clips-executive/specs/" ?spec:value "/parameters") "/config"))
  (wm-config-assert "/fawkes/agent" "/config/agent"))
