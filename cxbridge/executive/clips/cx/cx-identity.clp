;;; The name of this executive, kept in the world model under /cx/identity.

(deffunction cx-identity-set (?identity)
  "Set the name of this executive, or replace it."
  ; do-for-fact returns FALSE if there is no such fact
  (if (not (do-for-fact ((?wf wm-fact)) (eq ?wf:id "/cx/identity")
             (modify ?wf (type STRING) (value ?identity))
             TRUE))
   then
    (assert (wm-fact (id "/cx/identity") (type STRING) (value ?identity)))))

(deffunction cx-identity ()
  "The name of this executive; UNKNOWN before the first cx-identity-set."
  (do-for-fact ((?wf wm-fact)) (eq ?wf:id "/cx/identity")
    (return ?wf:value))
  "UNKNOWN")
