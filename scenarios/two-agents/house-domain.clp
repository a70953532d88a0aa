;;; The domain model, and the facts that the robots share.

(deftemplate room "A room, and the mutex of the room as a resource."
  (slot name (type SYMBOL))
  (slot number (type INTEGER))  ; the smallest number first
  (slot mutex (type SYMBOL)))

(defglobal
  ?*ROOMS* = (create$ kitchen bath hall study))

(defrule house-domain-load
  (executive-init)
  (not (domain-loaded))
  =>
  (parse-pddl-domain (path-resolve "domain.pddl"))
  (assert (domain-loaded)))

(defrule house-domain-facts
  "No room is known to be clean. Facts about rooms are shared with the other robot."
  (domain-loaded)
  (wm-fact (id "/cx/identity") (value ?me))
  (not (domain-facts-loaded))
  =>
  (progn$ (?room ?*ROOMS*)
    (assert (room (name ?room) (number ?room-index) (mutex (resource-to-mutex ?room)))))
  (wm-robmem-sync-enable "/domain/fact/swept" "/domain/fact/mopped")
  (blackboard-open-reading "SkillerInterface" ?me)
  (assert (skiller-control (skiller ?me))
          (domain-facts-loaded)))

(deffunction house-is (?what ?room)
  "Whether a room is known to be swept or mopped, or a robot to be full."
  (any-factp ((?fact domain-fact))
    (and (eq ?fact:name ?what) (eq ?fact:param-values (create$ ?room)))))

(deffunction house-is-noted (?id)
  "Whether the robot memory has the wm-fact."
  (bind ?query (bson-create))
  (bson-append ?query "_id" ?id)
  (bind ?cursor (robmem-query ?*WM-ROBMEM-SYNC-COLLECTION* ?query))
  (bson-destroy ?query)
  (if (not ?cursor) then (return FALSE))
  (bind ?document (robmem-cursor-next ?cursor))
  (if ?document then (bson-destroy ?document))
  (robmem-cursor-destroy ?cursor)
  (neq ?document FALSE))

(deffunction house-is-shared (?room)
  "Whether the robot memory has the state of a room. Missing facts are sent again, e.g. after its restart."
  (bind ?shared TRUE)
  (do-for-all-facts ((?fact wm-fact))
    (and (wm-key-prefix ?fact:key (create$ domain fact)) (eq (wm-key-arg ?fact:key room) ?room))
    (if (not (house-is-noted ?fact:id)) then
      (wm-robmem-sync-fact-update ?fact (cx-identity) (wm-robmem-sync-now))
      (bind ?shared FALSE)))
  ?shared)
