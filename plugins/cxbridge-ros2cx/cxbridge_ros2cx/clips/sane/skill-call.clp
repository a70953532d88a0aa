;;; Calls of skills for an agent.

(deffunction skill-words (?values)
  "The values as a text, separated by blanks."
  (bind ?text "")
  (progn$ (?value ?values)
    (bind ?text (str-cat ?text (if (eq ?value-index 1) then "" else " ") ?value)))
  ?text)

(deffunction skill-call (?name ?param-names ?param-values $?opt-agent-id)
  "Call the skill of an action for the agent (by default \"\"). Returns the id of the skill fact."
  (bind ?agent (if (eq ?opt-agent-id (create$)) then "" else (nth$ 1 ?opt-agent-id)))
  (bind ?text (map-action-skill ?name ?param-names ?param-values))
  (bind ?words (skill-words ?param-values))
  (bind ?id (sym-cat ?name "_" (gensym*)))
  (printout logwarn "Calling skill '" ?name " " ?words "' mapped to '" ?text "'" crlf)
  (call-skill-execution ?id ?name ?words ?text ?agent)
  (assert (skill (id ?id) (name (sym-cat ?name)) (parameters ?words) (skill-string ?text)
                 (agent-id ?agent) (status S_IDLE) (start-time (now))))
  ?id)
