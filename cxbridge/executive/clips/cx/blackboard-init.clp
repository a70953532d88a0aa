;;; Commands that enable reading the blackboard at each time fact, and load templates of interfaces.

(blackboard-enable-time-read)
(unwatch rules blackboard-read)  ; which fires at each time fact

;; Interface types whose templates must exist before rules on them are loaded.
(do-for-all-facts ((?spec confval) (?types confval))
    (and (eq ?spec:path "/clips-executive/spec")
         (eq ?spec:type STRING)
         (eq ?types:path (str-cat "/clips-executive/specs/" ?spec:value "/blackboard-preload"))
         (eq ?types:type STRING)
         (eq ?types:is-list TRUE))
  (progn$ (?type ?types:list-value)
    (blackboard-preload ?type)))
