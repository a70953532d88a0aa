;;; Replaces the original's skills.clp, whose skill-call omits the agent's id. The original is
;;; in a folder named clips, this file is not.

(batch* (path-resolve "../clips/skills.clp"))
(undeffunction skill-call)
(load* (path-resolve "skill-call.clp"))
