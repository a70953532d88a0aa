;;; skill-call as in ros2-clips-executive (2021), but with the id of the agent that executes the skill.

(deffunction skill-words (?values)
  "The values as a text, separated by blanks."
  (bind ?words "")
  (progn$ (?value ?values)
    (bind ?words (str-cat ?words (if (eq ?value-index 1) then "" else " ") ?value)))
  ?words)

(deffunction skill-call (?name ?param-names ?param-values $?opt-agent-id)
  "Call the skill of an action for the agent (by default \"\"). Returns the id of the skill fact."
  (bind ?agent (if (eq ?opt-agent-id (create$)) then "" else (nth$ 1 ?opt-agent-id)))
  (bind ?skill-string (map-action-skill ?name ?param-names ?param-values))
  (bind ?words (skill-words ?param-values))
  (bind ?id (sym-cat ?name "_" (gensym*)))
  ; logwarn, as in ros2-clips-executive
  (printout logwarn "Calling skill '" ?name " " ?words "' mapped to '" ?skill-string "'" crlf)
  (call-skill-execution ?id ?name ?words ?skill-string ?agent)
  (assert (skill (id ?id) (name (sym-cat ?name)) (parameters ?words) (skill-string ?skill-string)
                 (agent-id ?agent) (status S_IDLE) (start-time (now))))
  ?id)
